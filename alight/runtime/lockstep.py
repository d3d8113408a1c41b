"""All nodes in one process on a virtual clock: as fast as the machine can, repeatable to the bit.

Events (ticks, deliveries, bytes on a pipe, health reports) stand in one queue ordered by virtual time and, at equal
times, by the order in which they were made. Nothing depends on the wall clock or on threads.
"""

import heapq
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from alight.runtime.clock import VirtualClock, nanoseconds
from alight.runtime.host import NodeHost
from alight.runtime.journal import PERIOD_NS as JOURNAL_PERIOD_NS
from alight.runtime.node import Arrival, Node, Output, Publication
from schemas import topics
from schemas.message import Message
from schemas.settings import Settings
from schemas.topics import Topic

Event = Callable[[], None]


class Lockstep:
    """The deterministic executor."""

    def __init__(self, nodes: Sequence[Node], settings: Settings, clock: VirtualClock | None = None) -> None:
        """Take the nodes in.

        Args:
            nodes: One of each service; their order breaks ties.
            settings: For the virtual durations, the health period and the clock skew.
            clock: Where to begin; the fixed epoch by default.
        """
        self.clock = clock or VirtualClock()
        self._settings = settings
        self._queue: list[tuple[int, int, Event]] = []
        self._made = 0
        self._pipes: dict[tuple[str, str], tuple[NodeHost, str]] = {}
        self.hosts = [NodeHost(node, settings.bus, self.clock, pid=0, strict=True) for node in nodes]
        self._readers: dict[str, list[NodeHost]] = {
            topic.name: [host for host in self.hosts if topic in host.node.subscriptions] for topic in topics.TOPICS
        }
        for host in self.hosts:
            if not self._readers[topics.JOURNAL.name]:
                host.journal.keep_nothing()
            self._start(host)

    def join(self, one: Node, one_port: str, other: Node, other_port: str) -> None:
        """Connect two byte ports by an in-memory pipe."""
        self._pipes[(one.service, one_port)] = (self._host_of(other), other_port)
        self._pipes[(other.service, other_port)] = (self._host_of(one), one_port)

    def run(self, until_ns: int, finished: Callable[[], bool] = lambda: False) -> bool:
        """Run until a virtual time, or until `finished` says so (asked after each event).

        Returns:
            Whether `finished` said so.
        """
        while self._queue and self._queue[0][0] <= until_ns:
            at_ns, _, event = heapq.heappop(self._queue)
            self.clock.advance_to(at_ns)
            event()
            if finished():
                return True
        self.clock.advance_to(max(until_ns, self.clock.now_ns()))
        return False

    def close(self) -> None:
        """Let every node say its last words and let go."""
        for host in self.hosts:
            self._carry(host, host.stop(self.clock.now_ns()), None)
            self._carry(host, host.journal.rest(self.clock.now_ns()), None)
        self.run(self.clock.now_ns() + nanoseconds(self._settings.lockstep.hop_s) * 4)
        for host in self.hosts:
            host.node.close()

    def _host_of(self, node: Node) -> NodeHost:
        return next(host for host in self.hosts if host.node is node)

    def _start(self, host: NodeHost) -> None:
        now_ns = self.clock.now_ns()
        if host.node.tick_period_ns is not None:
            self._at(now_ns, partial(self._tick, host))
        self._at(now_ns + nanoseconds(self._settings.bus.health_period_s), partial(self._report, host))
        self._at(now_ns + JOURNAL_PERIOD_NS, partial(self._write_journal, host))

    def _at(self, at_ns: int, event: Event) -> None:
        heapq.heappush(self._queue, (at_ns, self._made, event))
        self._made += 1

    def _tick(self, host: NodeHost) -> None:
        now_ns = self.clock.now_ns()
        self._carry(host, host.tick(now_ns), None)
        assert host.node.tick_period_ns is not None
        self._at(now_ns + host.node.tick_period_ns, partial(self._tick, host))

    def _report(self, host: NodeHost) -> None:
        now_ns = self.clock.now_ns()
        self._carry(host, [Publication(topics.HEALTH, host.health.report(now_ns))], None)
        self._at(now_ns + nanoseconds(self._settings.bus.health_period_s), partial(self._report, host))

    def _write_journal(self, host: NodeHost) -> None:
        now_ns = self.clock.now_ns()
        self._carry(host, host.journal.rest(now_ns), None)
        self._at(now_ns + JOURNAL_PERIOD_NS, partial(self._write_journal, host))

    def _carry(self, host: NodeHost, outputs: Iterable[Output], cause: Arrival[Any] | None) -> None:
        processing_s = self._settings.lockstep.processing_s.get(host.node.service, 0.0) if cause else 0.0
        ready_ns = self.clock.now_ns() + nanoseconds(processing_s)
        for output in outputs:
            leaves_ns = max(ready_ns, output.release_at_ns or 0)
            if isinstance(output, Publication):
                self._at(leaves_ns, partial(self._publish, host, output, cause))
            else:
                self._pipe(host, output.port, output.data, leaves_ns)

    def _publish(self, host: NodeHost, publication: Publication, cause: Arrival[Any] | None) -> None:
        message = host.stamped(publication, cause, self.clock.now_ns())
        host.health.published(publication.topic, message, self.clock.now_ns())
        arrives_ns = self.clock.now_ns() + nanoseconds(self._settings.lockstep.hop_s)
        for reader in self._readers[publication.topic.name]:
            self._at(arrives_ns, partial(self._deliver, reader, publication.topic, message, publication.pixels))

    def _deliver(self, reader: NodeHost, topic: Topic[Any], message: Message, pixels: NDArray[np.uint8] | None) -> None:
        arrival = reader.admit(topic, message, pixels, self.clock.now_ns())
        if arrival is not None:
            self._carry(reader, reader.handle(arrival), arrival)

    def _pipe(self, host: NodeHost, port: str, data: bytes, leaves_ns: int) -> None:
        end = self._pipes.get((host.node.service, port))
        if end is None:
            return
        other, other_port = end
        arrives_ns = leaves_ns + nanoseconds(self._settings.lockstep.hop_s)
        self._at(arrives_ns, lambda: self._carry(other, other.take_bytes(other_port, data, self.clock.now_ns()), None))
