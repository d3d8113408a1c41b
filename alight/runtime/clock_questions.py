"""Asks the hosts of other services for their time over the bus, and answers them."""

import logging
import socket
import threading
from typing import Any

import zenoh
from pydantic import ValidationError

from alight.runtime.clock import Clock
from alight.runtime.peer_clocks import ClockAccount, PeerClocks
from schemas.clock import ClockReading

LOGGER = logging.getLogger("alight")

PERIOD_S = 10.0
"""Between two questions to the same service. An exchange costs both ends together 1.6 ms of processor time; no clock drifts far in ten seconds."""
FIRST_PERIOD_S = 0.5
FIRST_ROUNDS = 4
"""At the start the questions come quicker, so that a wrong clock is known before anything is flown by it."""
TIMEOUT_S = 1.0
MAX_ANSWER_BYTES = 4096


def clock_key(vehicle: str, service: str) -> str:
    """Where a service answers with its time."""
    return f"alight/{vehicle}/clock/{service}"


class ClockQuestions:
    """Runs on threads of its own and of Zenoh's: what carries pictures and setpoints neither waits for it nor does its work."""

    def __init__(self, session: Any, vehicle: str, service: str, peers: PeerClocks, clock: Clock) -> None:
        """Answer from now on; `start` begins to ask.

        Args:
            session: Zenoh's.
            vehicle: Whose bus.
            service: Our own name.
            peers: Whom to ask, and what came of it.
            clock: Ours.
        """
        self._session, self._vehicle, self._service, self._clock = session, vehicle, service, clock
        self._peers = peers
        self._lock = threading.Lock()
        self._host = socket.gethostname()
        self._stop = threading.Event()
        self._answering = session.declare_queryable(clock_key(vehicle, service), self._answer)
        self._thread = threading.Thread(target=self._ask_again_and_again, name="clocks", daemon=True)

    def start(self) -> None:
        """Begin to ask."""
        if self._peers.peers:
            self._thread.start()

    def close(self) -> None:
        """Ask no more; to be called before the session is closed."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(TIMEOUT_S)

    def account(self, now_ns: int) -> ClockAccount:
        """For `health`; safe from any thread."""
        with self._lock:
            return self._peers.account(now_ns)

    def _answer(self, query: zenoh.Query) -> None:
        received_at_ns = self._clock.now_ns()
        reading = ClockReading(
            service=self._service,
            host=self._host,
            received_at_ns=received_at_ns,
            answered_at_ns=self._clock.now_ns(),
        )
        query.reply(clock_key(self._vehicle, self._service), reading.model_dump_json().encode())

    def _ask_again_and_again(self) -> None:
        rounds = 0
        while not self._stop.wait(FIRST_PERIOD_S if rounds < FIRST_ROUNDS else PERIOD_S):
            for peer in self._peers.peers:
                try:
                    self._ask(peer)
                except zenoh.ZError:
                    return  # the session is closed: the process ends
            rounds += 1

    def _ask(self, peer: str) -> None:
        asked_ns = self._clock.now_ns()

        def on_reply(reply: zenoh.Reply) -> None:
            came_ns = self._clock.now_ns()
            if reply.ok is not None:
                self._take(peer, reply.ok.payload.to_bytes(), asked_ns, came_ns)

        self._session.get(clock_key(self._vehicle, peer), on_reply, timeout=TIMEOUT_S)

    def _take(self, peer: str, answer: bytes, asked_ns: int, came_ns: int) -> None:
        try:
            if len(answer) > MAX_ANSWER_BYTES:
                raise ValueError(f"{len(answer)} bytes")
            reading = ClockReading.model_validate_json(answer)
        except (ValidationError, ValueError):
            LOGGER.warning("no valid answer to the question for the time", extra={"of": peer})
            return
        with self._lock:
            self._peers.take(peer, reading, asked_ns, came_ns)
