"""Directs a hover: asks for nothing, and ends when enough has been seen."""

from collections.abc import Iterator

from alight.runtime.clock import seconds
from alight.runtime.node import Output
from schemas.settings import Settings
from station.director import FlightDirector, FlightPlan, Stage


class HoverDirector(FlightDirector):
    """Lets the vehicle, which begins in the air, hold its place for a while."""

    def __init__(self, settings: Settings, hover_s: float) -> None:
        super().__init__(settings, FlightPlan(takeoff_to_ned_m=None))
        self._hover_s = hover_s

    def on_tick(self, now_ns: int) -> Iterator[Output]:
        """See `Node.on_tick`."""
        if self._started_ns is None:
            self._started_ns = now_ns
        if seconds(now_ns - self._started_ns) >= self._hover_s:
            self.stage = Stage.OVER
        return iter(())
