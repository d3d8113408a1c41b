"""The clocks of the hosts that a service hears from: whom to ask and when, what came of it, and what is wrong."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from alight.runtime.clock import nanoseconds, seconds
from alight.runtime.clock_offset import ClockOffset, Exchange
from schemas.clock import ClockReading
from schemas.health import ClockHealth
from schemas.topics import Topic

MAX_ROUND_TRIP_NS = nanoseconds(1.0)
"""An answer that was longer on the way is left out: it tells less than any limit that is asked for."""
FORGET_AFTER_NS = nanoseconds(60.0)
"""A clock that has not answered for so long is unknown again."""


@dataclass(frozen=True)
class ClockAccount:
    """What `health` says of clocks."""

    clocks: tuple[ClockHealth, ...] = ()
    complaints: tuple[str, ...] = ()


class PeerClocks:
    """One offset a service; pure: it is told what was asked, what was answered, and the time."""

    def __init__(self, peers: Iterable[str], max_skew_s: float) -> None:
        """Begin with nothing known.

        Args:
            peers: The services whose clocks matter.
            max_skew_s: From how large an offset on it is complained of, seconds.
        """
        self._offsets = {peer: ClockOffset(MAX_ROUND_TRIP_NS) for peer in sorted(peers)}
        self._hosts = dict.fromkeys(self._offsets, "")
        self._max_skew_s = max_skew_s

    @property
    def peers(self) -> tuple[str, ...]:
        """Whom to ask."""
        return tuple(self._offsets)

    def take(self, peer: str, reading: ClockReading, asked_ns: int, came_ns: int) -> None:
        """Take an answer.

        Args:
            peer: Who was asked; an answer in another's name is left out.
            reading: The answer.
            asked_ns: When it was asked, UTC ns by our clock.
            came_ns: When the answer came, UTC ns by our clock.
        """
        offset = self._offsets.get(peer)
        if offset is None or reading.service != peer:
            return
        if offset.take(Exchange(asked_ns, reading.received_at_ns, reading.answered_at_ns, came_ns)):
            self._hosts[peer] = reading.host

    def account(self, now_ns: int) -> ClockAccount:
        """What is known of each, and which are too far off."""
        clocks = tuple(self._health(peer, offset, now_ns) for peer, offset in self._offsets.items())
        by_host: dict[str, list[ClockHealth]] = {}
        for clock in clocks:
            if clock.offset_s is not None and abs(clock.offset_s) > self._max_skew_s:
                by_host.setdefault(clock.host, []).append(clock)
        return ClockAccount(clocks, tuple(self._complaint(host, of_host) for host, of_host in by_host.items()))

    def _health(self, peer: str, offset: ClockOffset, now_ns: int) -> ClockHealth:
        best, came_ns = offset.best, offset.came_ns
        counts = {"answers": offset.taken, "outliers": offset.left_out}
        if best is None or came_ns is None:
            return ClockHealth(of=peer, **counts)
        age_s = seconds(max(0, now_ns - came_ns))
        if now_ns - came_ns > FORGET_AFTER_NS:
            return ClockHealth(of=peer, host=self._hosts[peer], age_s=age_s, **counts)
        return ClockHealth(
            of=peer,
            host=self._hosts[peer],
            offset_s=seconds(best.offset_ns),
            round_trip_s=seconds(best.round_trip_ns),
            uncertainty_s=seconds(best.round_trip_ns) / 2,
            jitter_s=offset.jitter_s,
            age_s=age_s,
            **counts,
        )

    def _complaint(self, host: str, clocks: list[ClockHealth]) -> str:
        worst = max(clocks, key=lambda clock: abs(clock.offset_s or 0.0))
        assert worst.offset_s is not None
        way = "ahead of" if worst.offset_s > 0.0 else "behind"
        return (
            f"the clock of host {host} ({', '.join(clock.of for clock in clocks)}) is {abs(worst.offset_s):.3f} s {way} ours, "
            f"bus.max_clock_skew_s is {self._max_skew_s:g}: set the hosts' clocks by NTP or PTP"
        )


def peers_of(service: str, subscriptions: Iterable[Topic[Any]]) -> frozenset[str]:
    """The services whose stamps a node judges: who publishes what it reads."""
    return frozenset(publisher for topic in subscriptions for publisher in topic.publishers) - {service}
