"""One node in its own process: on Zenoh, on the wall clock, with ports to the outside.

One thread at a time runs the node: whoever has the turn. Zenoh's and the ports' threads fill its mailbox, so a slow handler
delays nobody's reception, and what cannot wait is replaced by what is newer (frames). The runner's own thread empties it.
A message for a node that answers at once is not put there if nobody has the turn and nothing waits: the thread that received
it takes the turn itself, which saves waking another. Zenoh gives each subscription a thread of its own. While that thread is
busy with a picture the next ones wait in Zenoh, where no newer one takes their place: those go through the mailbox.
"""

import heapq
import os
import threading
import time
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from alight.runtime.bus import Bus
from alight.runtime.clock import NS_PER_S, Clock, WallClock, nanoseconds, seconds
from alight.runtime.clock_questions import ClockQuestions
from alight.runtime.frame_memory import FrameMemory
from alight.runtime.garbage_collection import GarbageCollection
from alight.runtime.host import NodeHost
from alight.runtime.mailbox import Letter, Mailbox
from alight.runtime.node import Arrival, Node, Output, Publication, Transmission
from alight.runtime.peer_clocks import PeerClocks, peers_of
from alight.runtime.port import Port
from schemas import topics
from schemas.message import Message
from schemas.settings import Settings
from schemas.topics import Delivery, Topic
from schemas.wire import WireMessage, encode

IDLE_S = 0.2
"""The loop looks at the stop flag at least this often."""
_HAS_WAITED_NS = nanoseconds(0.001)
"""A picture that is received this soon after the last one was done had come before."""


class _Packed(NamedTuple):
    """A message with its last hop, and the same as it travels."""

    topic: Topic[Any]
    message: Message
    wire: WireMessage
    held: Any
    """The picture in shared memory, if it is there."""


class _Due(NamedTuple):
    """What is kept back until its time. Nothing but the sending is left to do then."""

    at_ns: int
    number: int
    packed: _Packed | Transmission


class LiveRunner:
    """Runs a node until told to stop."""

    def __init__(
        self,
        node: Node,
        settings: Settings,
        ports: Mapping[str, Port],
        bus: Bus | None = None,
        clock: Clock | None = None,
    ) -> None:
        """Join the bus and open the ports.

        Args:
            node: What to run.
            settings: Of the bus, above all.
            ports: The byte ports that the node names.
            bus: One that has been joined already.
            clock: The time, UTC; the host's by default.

        Raises:
            BusError: If the bus cannot be joined.
            PortError: If a port cannot be opened.
        """
        self._clock: Clock = clock or WallClock()
        self._settings = settings
        self._host = NodeHost(node, settings.bus, self._clock, pid=os.getpid(), strict=False)
        self._mailbox = Mailbox(on_drop=self._host.health.dropped, frames=node.frames_waiting)
        self._due: list[_Due] = []
        self._made = 0
        self._picture_done_ns = 0
        self._memory = FrameMemory(wanted=settings.bus.shared_memory)
        self._stop = threading.Event()
        self._turn = threading.Lock()
        self._turn.acquire()  # nobody's until `run`
        self._failure: Exception | None = None
        self._garbage = GarbageCollection()
        self._next_tick_ns = self._next_health_ns = self._clock.now_ns()
        self._ports = dict(ports)
        for name, port in self._ports.items():
            port.open(lambda data, name=name: self._mailbox.put(Letter(self._clock.now_ns(), payload=data, port=name)))  # type: ignore[misc]
        self.bus = bus or Bus(settings.vehicle, settings.bus)
        for topic in node.subscriptions:
            self.bus.subscribe(topic, self._on_sample)
        peers = PeerClocks(peers_of(node.service, node.subscriptions), settings.bus.max_clock_skew_s)
        self._clocks = ClockQuestions(self.bus.session, settings.vehicle, node.service, peers, self._clock)
        self.bus.announce(node.service)  # who sees it may rely on its being heard

    def stop(self) -> None:
        """Ask `run` to return; safe from a signal handler and from any thread."""
        self._stop.set()

    def run(self) -> None:
        """Run the node until `stop`, then let it say its last words.

        Raises:
            Exception: What the bus or a port raised, whichever thread had the turn.
        """
        self._clocks.start()
        self._next_tick_ns = self._clock.now_ns()
        self._next_health_ns = self._next_tick_ns + nanoseconds(self._settings.bus.health_period_s)
        self._turn.release()
        while not self._stop.is_set():
            self._mailbox.wait(min(seconds(self._wake_ns() - self._clock.now_ns()), IDLE_S))
            with self._turn:
                self._take_turn()
        self._turn.acquire()  # for good: what comes now is not taken up any more
        if self._failure is not None:
            raise self._failure
        self._finish()

    def _wake_ns(self) -> int:
        wake_ns = self._next_health_ns
        if self._host.node.tick_period_ns:
            wake_ns = min(wake_ns, self._next_tick_ns)
        return min(wake_ns, self._due[0].at_ns) if self._due else wake_ns

    def _take_turn(self) -> None:
        letter = self._mailbox.take()
        if letter is not None:
            self._open(letter)
        now_ns = self._clock.now_ns()
        self._release(now_ns)
        period_ns = self._host.node.tick_period_ns
        if period_ns and now_ns >= self._next_tick_ns:
            self._carry(self._host.tick(now_ns), None)
            # A clock set back, or a long stall, must neither starve nor flood the node with ticks.
            self._next_tick_ns = _next_due(self._next_tick_ns, period_ns, now_ns)
        if now_ns >= self._next_health_ns or self._next_health_ns - now_ns > 10 * NS_PER_S:
            health = self._host.health.report(now_ns, self._clocks.account(now_ns))
            self._carry([Publication(topics.HEALTH, health)], None)
            self._next_health_ns = now_ns + nanoseconds(self._settings.bus.health_period_s)
        self._write_journal(now_ns)
        self._garbage.collect(now_ns, quiet=self._mailbox.is_empty())

    def _finish(self) -> None:
        self._carry(self._host.stop(self._clock.now_ns()), None)
        self._carry(self._host.journal.rest(self._clock.now_ns()), None)
        self._host.node.close()
        time.sleep(0.05)  # the last datagrams and messages leave the process
        for port in self._ports.values():
            port.close()
        self._clocks.close()
        self.bus.close()

    def _write_journal(self, now_ns: int) -> None:
        """Publish the journal when it is due; where no recorder listens yet, it waits for one."""
        if self._host.journal.is_due(now_ns) and self.bus.is_heard(topics.JOURNAL, self._host.node.service):
            self._carry(self._host.journal.rest(now_ns), None)

    def _on_sample(self, topic: Topic[Any], payload: bytes, attachment: bytes | None, encoding: str) -> None:
        letter = Letter(self._clock.now_ns(), topic, payload, attachment, encoding)
        if not (self._host.node.answers_at_once and self._opened_at_once(letter)):
            self._mailbox.put(letter)

    def _opened_at_once(self, letter: Letter) -> bool:
        """Whether it was this letter's turn. It is not where others wait: what came first is taken up first."""
        is_picture = letter.topic is not None and letter.topic.delivery is Delivery.STREAM
        if is_picture and abs(letter.received_at_ns - self._picture_done_ns) < _HAS_WAITED_NS:
            return False
        if not self._turn.acquire(blocking=False):
            return False
        try:
            if not self._mailbox.is_empty():
                return False
            self._open(letter)
            if is_picture:
                self._picture_done_ns = self._clock.now_ns()
        except Exception as error:  # it ends the process, as it would on the runner's thread
            self._failure = error
            self._stop.set()
        finally:
            self._turn.release()
        if self._due or self._failure is not None:
            self._mailbox.ring()  # the runner's thread sleeps until what was due before
        return True

    def _open(self, letter: Letter) -> None:
        if letter.topic is None:
            self._carry(self._host.take_bytes(letter.port, letter.payload, self._clock.now_ns()), None)
            return
        arrival = self._host.admit_wire(
            letter.topic, letter.payload, letter.attachment, letter.encoding, letter.received_at_ns
        )
        if arrival is not None:
            self._carry(self._host.handle(arrival), arrival)

    def _carry(self, outputs: Iterable[Output], cause: Arrival[Any] | None) -> None:
        """Send what may leave now. What has a time of release goes through the heap, so that it leaves in that order."""
        for output in outputs:
            if output.release_at_ns is None:
                self._send(self._packed(output, cause))
            else:
                heapq.heappush(self._due, _Due(output.release_at_ns, self._made, self._packed(output, cause)))
                self._made += 1
        self._release(self._clock.now_ns())

    def _release(self, now_ns: int) -> None:
        while self._due and self._due[0].at_ns <= now_ns:
            self._send(heapq.heappop(self._due).packed)

    def _packed(self, output: Output, cause: Arrival[Any] | None) -> _Packed | Transmission:
        """An output ready to leave: now, or at its time of release, which is then what its hop says."""
        if isinstance(output, Transmission):
            return output
        plain = held = None
        if output.pixels is not None:
            plain = output.pixels.tobytes()
            held = self._memory.held(plain)
        leaves_ns = max(self._clock.now_ns(), output.release_at_ns or 0)
        message = self._host.stamped(output, cause, leaves_ns)
        return _Packed(output.topic, message, encode(output.topic, message, plain), held)

    def _send(self, packed: _Packed | Transmission) -> None:
        if isinstance(packed, Transmission):
            port = self._ports.get(packed.port)
            if port is not None:
                port.send(packed.data)
            return
        self.bus.publish(packed.topic, self._host.node.service, packed.wire, packed.held)
        # Counted last: nobody waits for that.
        self._host.health.published(packed.topic, packed.message, self._clock.now_ns())


def _next_due(due_ns: int, period_ns: int, now_ns: int) -> int:
    if abs(now_ns - due_ns) > 10 * period_ns:
        return now_ns + period_ns
    return due_ns + period_ns
