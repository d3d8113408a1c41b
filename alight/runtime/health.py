"""What a service counts about itself, and the report it makes of it once a second."""

from collections import Counter
from typing import Any

from alight.runtime.clock import seconds
from alight.runtime.node import Node
from alight.runtime.peer_clocks import ClockAccount
from schemas.health import Health, InputHealth, OutputHealth
from schemas.message import Message, Traced
from schemas.topics import Topic


def percentile(values: list[float], fraction: float) -> float | None:
    """The value below which the given fraction of the values lies (nearest rank); None of nothing."""
    if not values:
        return None
    return sorted(values)[min(len(values) - 1, int(fraction * len(values)))]


class _Input:
    """Counts of one topic read."""

    def __init__(self, topic: Topic[Any]) -> None:
        self.topic = topic
        self.received = 0
        self.received_before = 0
        self.dropped = 0
        self.refused: Counter[str] = Counter()
        self.last_ns: int | None = None

    def is_stale(self, now_ns: int, since_ns: int) -> bool:
        if self.topic.stale_after_s is None:
            return False
        return seconds(now_ns - (self.last_ns or since_ns)) > self.topic.stale_after_s

    def report(self, now_ns: int, since_ns: int, period_s: float) -> InputHealth:
        rate_hz = (self.received - self.received_before) / period_s
        self.received_before = self.received
        return InputHealth(
            topic=self.topic.name,
            received=self.received,
            rate_hz=round(rate_hz, 3),
            dropped=self.dropped,
            refused=dict(sorted(self.refused.items())),
            age_s=None if self.last_ns is None else seconds(max(0, now_ns - self.last_ns)),
            stale=self.is_stale(now_ns, since_ns),
        )


class _Output:
    """Counts of one topic published."""

    def __init__(self) -> None:
        self.published = 0
        self.published_before = 0
        self.latencies_ms: list[float] = []

    def report(self, name: str, period_s: float) -> OutputHealth:
        rate_hz = (self.published - self.published_before) / period_s
        self.published_before = self.published
        latencies_ms, self.latencies_ms = self.latencies_ms, []
        return OutputHealth(
            topic=name,
            published=self.published,
            rate_hz=round(rate_hz, 3),
            latency_p50_ms=percentile(latencies_ms, 0.50),
            latency_p99_ms=percentile(latencies_ms, 0.99),
        )


class HealthMonitor:
    """Counts what passes a node and makes `Health` of it."""

    def __init__(self, node: Node, started_ns: int, pid: int) -> None:
        self._node = node
        self._pid = pid
        self._started_ns = started_ns
        self._reported_ns = started_ns
        self._inputs = {topic.name: _Input(topic) for topic in node.subscriptions}
        self._outputs: dict[str, _Output] = {}
        self._handling_ms: list[float] = []
        self._handler_errors = 0

    def accepted(self, topic: Topic[Any], now_ns: int) -> None:
        """A message came in."""
        entry = self._inputs[topic.name]
        entry.received += 1
        entry.last_ns = now_ns

    def refused(self, topic: Topic[Any], reason: str) -> None:
        """A message was turned away."""
        self._inputs[topic.name].refused[reason] += 1

    def dropped(self, topic: Topic[Any]) -> None:
        """A message was overwritten by a newer one before the node took it up."""
        self._inputs[topic.name].dropped += 1

    def published(self, topic: Topic[Any], message: Message, now_ns: int) -> None:
        """A message went out."""
        entry = self._outputs.setdefault(topic.name, _Output())
        entry.published += 1
        if isinstance(message, Traced):
            entry.latencies_ms.append((now_ns - message.captured_at_ns) / 1e6)

    def handled(self, duration_ns: int) -> None:
        """The node spent this long on one message."""
        self._handling_ms.append(duration_ns / 1e6)

    def handler_failed(self) -> None:
        """The node raised: a bug, which must not end the process in flight."""
        self._handler_errors += 1

    def report(self, now_ns: int, peers: ClockAccount = ClockAccount()) -> Health:  # noqa: B008 - it is frozen
        """The account since the last report, with what is known of other hosts' clocks."""
        period_s = max(1e-3, seconds(now_ns - self._reported_ns))
        self._reported_ns = now_ns
        handling_ms, self._handling_ms = self._handling_ms, []
        inputs = tuple(entry.report(now_ns, self._started_ns, period_s) for entry in self._inputs.values())
        return Health(
            at_ns=now_ns,
            service=self._node.service,
            pid=self._pid,
            uptime_s=seconds(max(0, now_ns - self._started_ns)),
            inputs=inputs,
            outputs=tuple(entry.report(name, period_s) for name, entry in sorted(self._outputs.items())),
            handling_p50_ms=percentile(handling_ms, 0.50),
            handling_p99_ms=percentile(handling_ms, 0.99),
            counters={**self._node.counters(), "handler_errors": self._handler_errors},
            complaints=(*self._complaints(inputs, now_ns), *peers.complaints),
            clocks=(*self._node.clocks(now_ns), *peers.clocks),
        )

    def _complaints(self, inputs: tuple[InputHealth, ...], now_ns: int) -> tuple[str, ...]:
        stale = [
            f"{entry.topic} silent " + ("since start" if entry.age_s is None else f"for {entry.age_s:.1f} s")
            for entry in inputs
            if entry.stale
        ]
        refused = [f"{entry.topic} refused: {entry.refused}" for entry in inputs if entry.refused]
        bugs = [f"{self._handler_errors} handler errors: see the log"] if self._handler_errors else []
        return (*stale, *refused, *bugs, *self._node.complaints(now_ns))
