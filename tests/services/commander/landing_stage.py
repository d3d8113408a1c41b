"""The stage for flights of the commander: a feeder that knows where the pad is, and a person who asks."""

from alight.geometry.local import moved_by_ned, ned_between
from alight.runtime.clock import nanoseconds, seconds
from alight.runtime.node import Arrival, Node, Publication
from schemas import topics
from schemas.estimate import PadEstimate
from schemas.message import GlobalPosition, Vector3
from schemas.mission import MissionReply, MissionRequest, MissionStatus, Phase, Verb
from schemas.setpoint import Setpoint
from schemas.vehicle import FlightMode, LandedState, VehicleState, VehicleStatus

START_NED_M = (10.0, 10.0, -20.0)
NOTHING_BELOW_M = 0.6


class KnownPad(Node):
    """Stands in for camera to filter: sees the pad at its known place, 30 times a second, 50 ms late, as long as it is not blinded."""

    service = "filter"
    tick_period_ns = nanoseconds(1 / 30)

    def __init__(self, pad: GlobalPosition | None = None, azimuth_rad: float = 0.3, sigma_m: float = 0.03) -> None:
        super().__init__()
        self.pad = pad
        self.azimuth_rad = azimuth_rad
        self.sigma_m = sigma_m
        self.blind = False
        self.drift_mps: Vector3 = (0.0, 0.0, 0.0)
        """How the pad moves in the vehicle's navigation solution."""
        self.tells_drift = True
        self._then_ns: int | None = None
        self.state: VehicleState | None = None
        self._seen_ns = 0
        self.subscribe(topics.VEHICLE_STATE, self._on_state)

    def _on_state(self, arrival: Arrival[VehicleState]) -> tuple[()]:
        self.state = arrival.message
        return ()

    def on_tick(self, now_ns: int) -> list[Publication]:
        state = self.state
        self._drift(now_ns)
        if state is None or self.pad is None or self.blind or state.at_ns <= self._seen_ns:
            return []
        n, e, d = ned_between(state.position, self.pad).tolist()
        if d < NOTHING_BELOW_M:
            return []
        self._seen_ns = state.at_ns
        s2 = self.sigma_m**2
        estimate = PadEstimate(
            captured_at_ns=state.at_ns,
            position=self.pad,
            pad_ned_m=(n, e, d),
            azimuth_rad=self.azimuth_rad,
            covariance_ned_m2=(s2, 0, 0, 0, s2, 0, 0, 0, s2),
            azimuth_variance_rad2=0.001,
            method="known",
            fixes_used=1,
            velocity_ned_mps=self.drift_mps if self.tells_drift else None,
            velocity_covariance_ned=(1e-4, 0, 0, 0, 1e-4, 0, 0, 0, 1e-4),
            position_at_ns=now_ns,
        )
        return [Publication(topics.PAD_ESTIMATE, estimate)]

    def _drift(self, now_ns: int) -> None:
        passed_s = seconds(now_ns - (self._then_ns or now_ns))
        self._then_ns = now_ns
        if self.pad is not None and any(self.drift_mps):
            north, east, down = (speed * passed_s for speed in self.drift_mps)
            self.pad = moved_by_ned(self.pad, (north, east, down))


class Person(Node):
    """Asks for the takeoff, and for the landing at the start point; keeps what the commander says."""

    service = "station"
    tick_period_ns = nanoseconds(0.1)

    def __init__(self, start_ned_m=START_NED_M, land_at_start: bool = True) -> None:
        super().__init__()
        self.start_ned_m = start_ned_m
        self.land_at_start = land_at_start
        self.wishes: list[MissionRequest] = []
        self.replies: list[MissionReply] = []
        self.phases: list[MissionStatus] = []
        self.mission: MissionStatus | None = None
        self.vehicle: VehicleStatus | None = None
        self._asked_takeoff_ns: int | None = None
        self._count = 0
        self.subscribe(topics.MISSION_STATUS, self._on_mission)
        self.subscribe(topics.VEHICLE_STATUS, self._on_vehicle)
        self.subscribe(topics.REPLY, self._on_reply)

    def wish(self, verb: Verb, now_ns: int, **more: object) -> str:
        self._count += 1
        request = MissionRequest(at_ns=now_ns, request_id=f"wish-{self._count}", verb=verb, **more)
        self.wishes.append(request)
        return request.request_id

    @property
    def codes(self) -> list[str]:
        """`phase:code` of every phase so far."""
        return [f"{status.phase}:{status.code}" for status in self.phases]

    @property
    def phase(self) -> Phase | None:
        return None if self.mission is None else self.mission.phase

    def on_tick(self, now_ns: int) -> list[Publication]:
        ready = self.vehicle is not None and self.vehicle.ready_to_arm and self.phase is Phase.IDLE
        waited = self._asked_takeoff_ns is None or now_ns - self._asked_takeoff_ns > nanoseconds(1.0)
        if self.start_ned_m is not None and ready and waited:
            self._asked_takeoff_ns = now_ns
            self.wish(Verb.TAKEOFF, now_ns, start_ned_m=self.start_ned_m)
        wishes, self.wishes = self.wishes, []
        return [Publication(topics.REQUEST, wish) for wish in wishes]

    def _on_mission(self, arrival: Arrival[MissionStatus]) -> list[Publication]:
        before, self.mission = self.mission, arrival.message
        changed = before is None or before.phase_since_ns != self.mission.phase_since_ns
        if changed:
            self.phases.append(self.mission)
            if self.mission.code == "at_start" and self.land_at_start:
                self.wish(Verb.LAND, arrival.now_ns)
        return []

    def _on_vehicle(self, arrival: Arrival[VehicleStatus]) -> tuple[()]:
        self.vehicle = arrival.message
        return ()

    def _on_reply(self, arrival: Arrival[MissionReply]) -> tuple[()]:
        self.replies.append(arrival.message)
        return ()


class Scribe(Node):
    """Keeps what the commander publishes."""

    service = "recorder"

    def __init__(self) -> None:
        super().__init__()
        self.setpoints: list[Setpoint] = []
        self.states: list[VehicleState] = []
        self.subscribe(topics.SETPOINT, self._on_setpoint)
        self.subscribe(topics.VEHICLE_STATE, self._on_state)

    def _on_setpoint(self, arrival: Arrival[Setpoint]) -> tuple[()]:
        self.setpoints.append(arrival.message)
        return ()

    def _on_state(self, arrival: Arrival[VehicleState]) -> tuple[()]:
        self.states.append(arrival.message)
        return ()


def landed_and_holding(status: VehicleStatus | None) -> bool:
    return (
        status is not None
        and not status.armed
        and status.landed_state is LandedState.ON_GROUND
        and status.mode is FlightMode.HOLD
    )


def place(origin: GlobalPosition, north_m: float, east_m: float, up_m: float = 0.0) -> GlobalPosition:
    return moved_by_ned(origin, (north_m, east_m, -up_m))
