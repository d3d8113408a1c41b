"""The commander node: joins the link, the mission and the bus."""

from collections.abc import Iterator, Mapping

from alight.runtime.clock import nanoseconds
from alight.runtime.node import Arrival, Node, Output, Outputs, Publication, Transmission
from schemas import topics
from schemas.estimate import PadEstimate
from schemas.health import ClockHealth
from schemas.mission import MissionRequest
from schemas.setpoint import Setpoint
from schemas.settings import Settings
from services.commander.link import AutopilotLink
from services.commander.mission import Mission

STATUS_PERIOD_NS = nanoseconds(0.2)
GIMBAL_PERIOD_NS = nanoseconds(0.1)
VEHICLE = "vehicle"


class CommanderNode(Node):
    """Speaks MAVLink to one autopilot and brings its vehicle down when asked."""

    service = "commander"
    answers_at_once = True
    ports = (VEHICLE,)

    def __init__(self, settings: Settings) -> None:
        super().__init__()
        self.tick_period_ns = nanoseconds(settings.commander.tick_s)
        self._link = AutopilotLink(settings.commander)
        self._mission = Mission(settings.commander, self._link)
        self._facts: tuple[object, ...] = ()
        self._phase = (self._mission.phase, self._mission.code, 0)
        self._published_ns: dict[str, int] = {}
        self._gimbal_ns = 0
        self.subscribe(topics.PAD_ESTIMATE, self._on_estimate)
        self.subscribe(topics.REQUEST, self._on_request)

    def on_bytes(self, port: str, data: bytes, now_ns: int) -> Outputs:  # noqa: ARG002
        """Take bytes from the autopilot."""
        if not self._link.receive(data, now_ns):
            return
        for state in self._link.take_states():
            self._mission.take_state(state)
            yield Publication(topics.VEHICLE_STATE, state)
        if self._link.facts(now_ns) != self._facts:
            yield from self._act(self._mission.step(now_ns), now_ns)
        else:
            yield from self._transmit()

    def on_tick(self, now_ns: int) -> Outputs:
        """Look around even if nothing comes in."""
        self._link.advance(now_ns)
        yield from self._act(self._mission.step(now_ns), now_ns)
        if now_ns - self._gimbal_ns >= GIMBAL_PERIOD_NS:
            self._gimbal_ns = now_ns
            gimbal = self._link.gimbal(now_ns)
            if self._is_newer(topics.GIMBAL_STATE.name, gimbal.at_ns):
                yield Publication(topics.GIMBAL_STATE, gimbal)

    def on_stop(self, now_ns: int) -> Outputs:
        """Leave a vehicle that is under command holding."""
        self._mission.last_words(now_ns)
        yield from self._transmit()

    def counters(self) -> Mapping[str, int]:
        """Counts of the link and of the estimate gate."""
        return {**self._link.counters(), **self._mission.gate.counts}

    def complaints(self, now_ns: int) -> tuple[str, ...]:
        """What is wrong with the link or with the autopilot's settings."""
        return self._link.complaints(now_ns)

    def clocks(self, now_ns: int) -> tuple[ClockHealth, ...]:
        """How well the autopilot's clock is known."""
        return (self._link.clock.health(now_ns),)

    def _on_estimate(self, arrival: Arrival[PadEstimate]) -> Iterator[Output]:
        yield from self._act(self._mission.take_estimate(arrival.message, arrival.now_ns), arrival.now_ns)

    def _on_request(self, arrival: Arrival[MissionRequest]) -> Iterator[Output]:
        if not self._mission.has_looked:
            # What a start in flight calls for comes before what is asked, and would take the place of it in one step.
            yield from self._act(self._mission.step(arrival.now_ns), arrival.now_ns)
        self._mission.take_request(arrival.message, arrival.now_ns)
        yield from self._act(self._mission.step(arrival.now_ns), arrival.now_ns)
        yield Publication(topics.REPLY, self._mission.reply_to(arrival.message, arrival.now_ns))

    def _act(self, setpoint: Setpoint | None, now_ns: int) -> Iterator[Output]:
        """The bytes first: nothing may stand between a decision and the vehicle."""
        yield from self._transmit()
        if setpoint is not None and self._is_newer(topics.SETPOINT.name, setpoint.stamp_ns):
            yield Publication(topics.SETPOINT, setpoint)
        yield from self._report(now_ns)

    def _transmit(self) -> Iterator[Output]:
        data = self._link.outgoing()
        if data:
            yield Transmission(VEHICLE, data)

    def _report(self, now_ns: int) -> Iterator[Output]:
        """Status of mission and vehicle: at once when something changed, and periodically."""
        phase = (self._mission.phase, self._mission.code, self._mission.since_ns or 0)
        if phase != self._phase or self._is_due(topics.MISSION_STATUS.name, now_ns):
            self._phase = phase
            at_ns = self._next_stamp_ns(topics.MISSION_STATUS.name, now_ns)
            yield Publication(topics.MISSION_STATUS, self._mission.status(at_ns))
        facts = self._link.facts(now_ns)
        if facts != self._facts or self._is_due(topics.VEHICLE_STATUS.name, now_ns):
            self._facts = facts
            at_ns = self._next_stamp_ns(topics.VEHICLE_STATUS.name, now_ns)
            yield Publication(topics.VEHICLE_STATUS, self._link.status(now_ns).model_copy(update={"at_ns": at_ns}))

    def _is_due(self, topic: str, now_ns: int) -> bool:
        return now_ns - self._published_ns.get(topic, 0) >= STATUS_PERIOD_NS

    def _next_stamp_ns(self, topic: str, now_ns: int) -> int:
        """Now, or just after the last one: readers refuse a stamp that is not newer."""
        self._published_ns[topic] = max(now_ns, self._published_ns.get(topic, 0) + 1)
        return self._published_ns[topic]

    def _is_newer(self, topic: str, stamp_ns: int) -> bool:
        newer = stamp_ns > self._published_ns.get(topic, 0)
        self._published_ns[topic] = max(stamp_ns, self._published_ns.get(topic, 0))
        return newer
