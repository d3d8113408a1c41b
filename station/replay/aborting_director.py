"""A director that gives a landing up on the way down: for reference flights."""

from collections.abc import Iterator

from alight.runtime.clock import seconds
from alight.runtime.node import Output, Publication
from schemas import topics
from schemas.mission import MissionRequest, Phase, Verb
from schemas.settings import Settings
from station.director import FlightDirector, FlightPlan


class AbortingDirector(FlightDirector):
    """Directs a landing and asks for its end some time after the descent has begun."""

    def __init__(self, settings: Settings, plan: FlightPlan, after_s: float) -> None:
        super().__init__(settings, plan)
        self._after_s = after_s
        self._asked_to_abort = False

    def on_tick(self, now_ns: int) -> Iterator[Output]:
        """See `Node.on_tick`."""
        yield from super().on_tick(now_ns)
        mission = self.view.mission
        if self._asked_to_abort or mission is None or mission.phase is not Phase.DESCEND:
            return
        if seconds(now_ns - mission.phase_since_ns) >= self._after_s:
            self._asked_to_abort = True
            request = MissionRequest(
                at_ns=now_ns, request_id=f"abort-{now_ns}", verb=Verb.ABORT, reason="a person on the field"
            )
            yield Publication(topics.REQUEST, request)
