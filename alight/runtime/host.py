"""What stands around a node in every mode: the gate before it, the hop stamp behind it, the count of both."""

import logging
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from alight.runtime.admission import Admission
from alight.runtime.clock import Clock
from alight.runtime.health import HealthMonitor
from alight.runtime.journal import JournalKeeper
from alight.runtime.node import Arrival, Node, Output, Outputs, Publication
from schemas import topics
from schemas.frame import FrameHeader
from schemas.message import Hop, Message, Traced
from schemas.settings.bus import BusSettings
from schemas.topics import Topic
from schemas.wire import RefusedError, decode

LOGGER = logging.getLogger("alight")


class NodeHost:
    """Runs one node for an executor (live or lockstep), which owns the clock and carries the outputs."""

    def __init__(self, node: Node, bus: BusSettings, clock: Clock, *, pid: int, strict: bool) -> None:
        """Wrap a node.

        Args:
            node: The node.
            bus: For the clock skew that is tolerated.
            clock: The executor's.
            pid: Process id to report; 0 in lockstep.
            strict: Let a bug in the node surface (lockstep, tests) instead of counting it and going on (live).
        """
        self.node = node
        self.health = HealthMonitor(node, clock.now_ns(), pid)
        self.journal = JournalKeeper(node, clock.now_ns())
        self._admission = Admission(bus.max_clock_skew_s, any_age=node.takes_any_age)
        self._clock = clock
        self._strict = strict
        self._may_publish = frozenset(topic.name for topic in topics.published_by(node.service))

    def admit_wire(
        self, topic: Topic[Any], payload: bytes, attachment: bytes | None, encoding: str, received_at_ns: int
    ) -> Arrival[Any] | None:
        """Decode and judge what came over the bus; None if it was refused (and counted)."""
        try:
            message = decode(topic, payload, attachment, encoding)
        except RefusedError as error:
            self._refuse(topic, error)
            return None
        pixels = _pixels_of(message, payload) if topic.has_pixels else None
        return self.admit(topic, message, pixels, received_at_ns)

    def admit(
        self, topic: Topic[Any], message: Message, pixels: NDArray[np.uint8] | None, received_at_ns: int
    ) -> Arrival[Any] | None:
        """Judge a message that is already typed; None if it was refused (and counted)."""
        now_ns = self._clock.now_ns()
        try:
            self._admission.admit(topic, message, now_ns)
        except RefusedError as error:
            self._refuse(topic, error)
            return None
        self.health.accepted(topic, now_ns)
        return Arrival(topic, message, received_at_ns, now_ns, pixels)

    # These give the outputs one by one, as the node makes them: what it says first leaves before it goes on. Exhaust them.

    def handle(self, arrival: Arrival[Any]) -> Iterator[Output]:
        """Let the node take a message. It is written down last: nobody waits for that."""
        yield from self._guarded(lambda: self.node.on_message(arrival))
        self.journal.message(arrival)

    def tick(self, now_ns: int) -> Iterator[Output]:
        """Let the node do what is due."""
        yield from self._guarded(lambda: self.node.on_tick(now_ns))
        self.journal.tick(now_ns)

    def take_bytes(self, port: str, data: bytes, now_ns: int) -> Iterator[Output]:
        """Let the node take bytes from a port."""
        yield from self._guarded(lambda: self.node.on_bytes(port, data, now_ns))
        self.journal.bytes(port, data, now_ns)

    def stop(self, now_ns: int) -> Iterator[Output]:
        """The node's last words."""
        return self._guarded(lambda: self.node.on_stop(now_ns))

    def stamped(self, publication: Publication, cause: Arrival[Any] | None, now_ns: int) -> Message:
        """The message as it leaves: with this service's hop.

        Raises:
            ValueError: If the table of topics does not let this service publish there.
        """
        topic, message = publication.topic, publication.message
        if topic.name not in self._may_publish:
            raise ValueError(f"{self.node.service} may not publish {topic.name}: see schemas/topics.py")
        if isinstance(message, Traced):
            received_ns = cause.received_at_ns if cause else now_ns
            handled_ns = cause.now_ns if cause else now_ns
            message = message.with_hop(
                Hop(
                    service=self.node.service,
                    received_at_ns=min(received_ns, now_ns),
                    handled_at_ns=min(handled_ns, now_ns),
                    published_at_ns=now_ns,
                )
            )
        return message

    def _refuse(self, topic: Topic[Any], error: RefusedError) -> None:
        self.health.refused(topic, error.refusal)
        LOGGER.warning("input refused", extra={"topic": topic.name, "detail": str(error)})

    def _guarded(self, call: Callable[[], Outputs]) -> Iterator[Output]:
        spent_ns, began_ns = 0, time.perf_counter_ns()
        try:
            for output in call():
                spent_ns += time.perf_counter_ns() - began_ns
                yield output
                began_ns = time.perf_counter_ns()
        except Exception:
            if self._strict:
                raise
            self.health.handler_failed()
            LOGGER.exception("handler failed", extra={"service": self.node.service})
        if not self._strict:  # in lockstep the machine's speed must leave no trace
            self.health.handled(spent_ns + time.perf_counter_ns() - began_ns)


def _pixels_of(header: FrameHeader, payload: bytes) -> NDArray[np.uint8]:
    channels = header.pixel_format.bytes_per_pixel
    shape = (header.height_px, header.width_px) if channels == 1 else (header.height_px, header.width_px, channels)
    return np.frombuffer(payload, dtype=np.uint8).reshape(shape)
