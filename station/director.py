"""The director asks for a flight and follows it: take off and fly to the start if told to, then land.

It is a node like any other, so a live and a lockstep flight are directed by the same code. It commands nothing itself: it
asks the commander, and asks again for a landing that a restart of the commander cut off.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum

from alight.runtime.clock import nanoseconds, seconds
from alight.runtime.node import Arrival, Node, Output, Publication
from schemas import topics
from schemas.fix import FixVerdict
from schemas.health import Health
from schemas.message import Vector3
from schemas.mission import GIVEN_UP, MissionReply, MissionRequest, MissionStatus, Phase, Verb
from schemas.settings import Settings
from schemas.vehicle import FlightMode, LandedState, VehicleStatus

ASK_AGAIN_S = 1.0
"""A request without a reply is repeated after this; its id stays, so it is acted on once."""
MAX_LANDING_REQUESTS = 4
"""How often a landing is asked for before the flight counts as failed."""
RESTARTED = "restarted_in_flight"
"""The code of a commander that was restarted in the air and so forgot what it was asked."""
FORGOTTEN_AFTER_S = 1.5
"""A commander that is idle so long after it took a request has forgotten it."""
RESTART_SETTLES_S = 2.0
"""A restarted commander's word on the vehicle may come after its word on the mission."""
STATUS_GAP_S = 0.5
"""The commander speaks of the vehicle five times a second; after a longer silence it may be another process. One that starts
quicker is known by its first word: it has not heard the autopilot, and so knows no mode."""

HOLDS_WITHIN_S = 0.5
"""A vehicle that holds so soon after a restarted commander told it to does so for that, not for a pilot, even where a failsafe came
between the two."""

NO_DETECTIONS = "no detections are coming: are camera and detector running?"


class Stage(StrEnum):
    """Where the director is."""

    CONNECTING = "connecting"
    """Waiting for vehicle, commander and detector."""
    GOING_UP = "going up"
    """Takeoff and transit were asked for."""
    LANDING = "landing"
    """Landing was asked for."""
    OVER = "over"
    """Landed or not: nothing more is asked."""


@dataclass(frozen=True)
class FlightPlan:
    """What shall be flown."""

    takeoff_to_ned_m: Vector3 | None
    """Take off and fly there first, north, east, down of the point of takeoff, metres; None expects it in the air."""
    connect_timeout_s: float = 30.0
    """How long to wait for vehicle, commander and detector."""
    flight_timeout_s: float = 300.0
    """How long the flight may take in all."""


@dataclass
class View:
    """The newest of everything, for the progress display."""

    mission: MissionStatus | None = None
    vehicle: VehicleStatus | None = None
    health: dict[str, Health] = field(default_factory=dict)
    frames_seen: int = 0
    """Detections that reached the geolocator since its start, by its health report. The detections themselves are not read
    here: every further reader of a topic makes the others wait."""
    frames_with_pad: int = 0
    """Those that showed the pad."""


class FlightDirector(Node):
    """Asks for the flight in `plan` and says when it is over, and how it ended."""

    service = "station"
    tick_period_ns = nanoseconds(0.1)

    def __init__(self, settings: Settings, plan: FlightPlan) -> None:
        super().__init__()
        self.view = View()
        self.stage = Stage.CONNECTING
        self.failure: str | None = None
        """Why the flight failed; None while it goes on, and after a good one."""
        self._settings = settings
        self._plan = plan
        self._started_ns: int | None = None
        self._pending: MissionRequest | None = None
        self._asked_ns = 0
        self._refused: str | None = None
        self._connect_from_ns = 0
        self._phase_asked_in_ns = 0
        self._restarted = False
        self._ask_from_ns = 0
        self._mode_before_restart = FlightMode.UNKNOWN
        self._mode_since_ns = 0
        self._told_to_hold_ns: int | None = None
        self._requests = 0
        self._landing_requests = 0
        self.subscribe(topics.MISSION_STATUS, self._on_mission)
        self.subscribe(topics.VEHICLE_STATUS, self._on_vehicle)
        self.subscribe(topics.REPLY, self._on_reply)
        self.subscribe(topics.HEALTH, self._on_health)

    @property
    def over(self) -> bool:
        """Whether the flight has ended, well or not."""
        return self.stage is Stage.OVER

    def on_tick(self, now_ns: int) -> Iterator[Output]:
        """Ask for what is due; see `Node.on_tick`."""
        if self._started_ns is None:
            self._started_ns = now_ns
        elapsed_s = seconds(now_ns - self._started_ns)
        if self.over:
            return
        if elapsed_s > self._plan.flight_timeout_s:
            self._fail(f"not landed {self._plan.flight_timeout_s:.0f} s after the start: {self._where()}")
        elif self.stage is Stage.CONNECTING:
            yield from self._connect(now_ns, elapsed_s)
        elif self._pending is not None and seconds(now_ns - self._asked_ns) > ASK_AGAIN_S:
            yield self._send(self._pending.model_copy(update={"at_ns": now_ns}), now_ns)

    def _connect(self, now_ns: int, elapsed_s: float) -> Iterator[Output]:
        if now_ns < self._connect_from_ns:
            return
        missing, ended = self._missing(), self._ended_since_asked()
        if ended is not None:
            self._fail(ended)
        elif missing is None:
            grounded = self.view.vehicle is not None and self.view.vehicle.landed_state is LandedState.ON_GROUND
            if not grounded:
                yield from self._ask_landing(now_ns)
            elif self._plan.takeoff_to_ned_m is not None:
                self.stage = Stage.GOING_UP
                yield self._ask(Verb.TAKEOFF, now_ns, start_ned_m=self._plan.takeoff_to_ned_m)
            else:
                self._fail("the vehicle stands on the ground: take off by hand first, or add --takeoff")
        elif elapsed_s > self._plan.connect_timeout_s:
            why = self._refused or missing
            said = self._said_of_seeing() if why == NO_DETECTIONS else ""
            self._fail(f"{why} after {self._plan.connect_timeout_s:.0f} s{said}")

    def _ended_since_asked(self) -> str | None:
        """What the commander gave up for in the moment when it refused: that is no refusal to ask again after."""
        mission = self.view.mission
        if self._refused is None or mission is None or mission.phase not in GIVEN_UP or mission.code == RESTARTED:
            return None
        return None if mission.phase_since_ns == self._phase_asked_in_ns else f"{mission.phase}: {mission.reason}"

    def _missing(self) -> str | None:
        vehicle = self.view.vehicle
        if self.view.mission is None:
            return "no commander is answering: is it running, and on this bus?"
        if vehicle is None or not vehicle.connected:
            return f"no vehicle is answering at {self._settings.commander.vehicle_url}: is it on, and sending there?"
        if self.view.frames_seen == 0:
            return NO_DETECTIONS
        if vehicle.landed_state is LandedState.UNDEFINED:
            return "the vehicle does not say whether it is on the ground"
        if vehicle.landed_state is LandedState.ON_GROUND and not vehicle.ready_to_arm:
            return f"the vehicle is not ready to arm ({vehicle.last_text or 'no reason given'})"
        return None

    def _said_of_seeing(self) -> str:
        """What camera and detector complain of; that no estimates come is no cause but follows."""
        said = []
        for service in ("camera", "detector"):
            health = self.view.health.get(service)
            complaints = ("nothing is heard of it",) if health is None else health.complaints
            said += [f"{service}: {text}" for text in complaints if not text.startswith(topics.PAD_ESTIMATE.name)]
        return f" ({'; '.join(said)})" if said else ""

    def _on_mission(self, arrival: Arrival[MissionStatus]) -> Iterator[Output]:
        mission = arrival.message
        self.view.mission = mission
        if mission.phase is Phase.HOLD and mission.code == RESTARTED:
            self._told_to_hold_ns = mission.phase_since_ns
        now_ns = arrival.now_ns
        if self.stage is Stage.GOING_UP:
            yield from self._follow_up(mission, now_ns)
        elif self.stage is Stage.LANDING and self._pending is None:
            yield from self._follow_down(mission, now_ns)

    def _follow_up(self, mission: MissionStatus, now_ns: int) -> Iterator[Output]:
        if self._pending is None and mission.phase is Phase.HOLD and mission.code == "at_start":
            yield from self._ask_landing(now_ns)
        elif self._pending is None and self._lost_memory(mission):
            # Where the vehicle is by now nobody knows: what can still be done safely is to land.
            yield from self._ask_restarted(now_ns)
        elif mission.phase in GIVEN_UP:
            self._fail(f"{mission.phase}: {mission.reason}")

    def _follow_down(self, mission: MissionStatus, now_ns: int) -> Iterator[Output]:
        if mission.phase is Phase.LANDED:
            self.stage = Stage.OVER
        elif self._lost_memory(mission):
            if self._landing_requests < MAX_LANDING_REQUESTS:
                yield from self._ask_restarted(now_ns)
            else:
                self._fail(self._refused or f"the commander restarted {self._landing_requests} times")
        elif mission.phase in GIVEN_UP and not _just_restarted(mission):
            self._fail(f"{mission.phase}: {mission.reason}")

    def _on_reply(self, arrival: Arrival[MissionReply]) -> Iterator[Output]:
        reply = arrival.message
        if self._pending is not None and reply.request_id == self._pending.request_id:
            verb, self._pending = self._pending.verb, None
            if not reply.accepted:
                self._take_refusal(f"{verb} was refused: {reply.reason}", arrival.now_ns)
        return iter(())

    def _take_refusal(self, reason: str, now_ns: int) -> None:
        """What is refused at the start, of the flight or of the commander, before all is known, may be granted a moment later."""
        assert self._started_ns is not None, "nothing is asked before the first tick"
        if self._restarted:
            self._refused, self._ask_from_ns = reason, now_ns + nanoseconds(ASK_AGAIN_S)
        elif seconds(now_ns - self._started_ns) > self._plan.connect_timeout_s:
            self._fail(reason)
        else:
            self.stage = Stage.CONNECTING
            self._refused, self._connect_from_ns = reason, now_ns + nanoseconds(ASK_AGAIN_S)

    def _on_vehicle(self, arrival: Arrival[VehicleStatus]) -> Iterator[Output]:
        before, self.view.vehicle = self.view.vehicle, arrival.message
        if before is not None and not _never_heard(before) and _may_be_another(before, arrival.message):
            self._mode_before_restart = before.mode
        if before is None or before.mode is not arrival.message.mode:
            self._mode_since_ns = arrival.message.at_ns
        return iter(())

    def _on_health(self, arrival: Arrival[Health]) -> Iterator[Output]:
        health = arrival.message
        self.view.health[health.service] = health
        if health.service == "geolocator":
            self.view.frames_seen = sum(
                entry.received for entry in health.inputs if entry.topic == topics.DETECTION.name
            )
            self.view.frames_with_pad = self.view.frames_seen - health.counters.get(f"fix_{FixVerdict.NO_MARKER}", 0)
        return iter(())

    def _ask_restarted(self, now_ns: int) -> Iterator[Output]:
        """Each time only if nobody has taken over until then: a refusal must not lead back to the first, unguarded asking."""
        self._restarted = True
        if now_ns >= self._ask_from_ns:
            yield from self._ask_landing(now_ns)

    def _ask_landing(self, now_ns: int) -> Iterator[Output]:
        self.stage = Stage.LANDING
        self._landing_requests += 1
        yield self._ask(Verb.LAND, now_ns)

    def _ask(self, verb: Verb, now_ns: int, start_ned_m: Vector3 | None = None) -> Output:
        self._requests += 1
        self._phase_asked_in_ns = self.view.mission.phase_since_ns if self.view.mission else 0
        request_id = f"flight-{now_ns}-{self._requests}"
        request = MissionRequest(at_ns=now_ns, request_id=request_id, verb=verb, start_ned_m=start_ned_m)
        return self._send(request, now_ns)

    def _send(self, request: MissionRequest, now_ns: int) -> Output:
        self._pending, self._asked_ns = request, now_ns
        return Publication(topics.REQUEST, request)

    def _fail(self, reason: str) -> None:
        self.failure = reason
        self.stage = Stage.OVER

    def _where(self) -> str:
        mission = self.view.mission
        return f"{mission.phase}: {mission.reason}" if mission else "no word from the commander"

    def _lost_memory(self, mission: MissionStatus) -> bool:
        """Whether the commander was restarted and nobody else flies since: only then may the landing be asked for again."""
        if mission.code == RESTARTED:
            return mission.phase is Phase.HOLD or (mission.phase is Phase.YIELDED and self._nobody_took_over())
        forgotten = mission.phase is Phase.IDLE and seconds(mission.at_ns - self._asked_ns) > FORGOTTEN_AFTER_S
        return forgotten and self._knows_vehicle(mission)

    def _knows_vehicle(self, mission: MissionStatus) -> bool:
        """Whether a commander that is idle has seen the vehicle since its start; in the air it does not stay idle then."""
        vehicle = self.view.vehicle
        return (
            vehicle is not None
            and vehicle.at_ns >= mission.phase_since_ns
            and vehicle.connected
            and vehicle.landed_state is not LandedState.UNDEFINED
        )

    def _nobody_took_over(self) -> bool:
        """Whether the autopilot still intends the commander's setpoints, or holds as it did when the commander died or as it was told."""
        vehicle = self.view.vehicle
        if vehicle is None:
            return False
        holds_on = vehicle.mode is FlightMode.HOLD and self._mode_before_restart is FlightMode.HOLD
        return vehicle.intended_mode is FlightMode.OFFBOARD or holds_on or self._holds_as_told(vehicle)

    def _holds_as_told(self, vehicle: VehicleStatus) -> bool:
        """Whether it was a restarted commander that told the vehicle to hold, as it does now."""
        if vehicle.mode is not FlightMode.HOLD or self._told_to_hold_ns is None:
            return False
        return 0.0 <= seconds(self._mode_since_ns - self._told_to_hold_ns) <= HOLDS_WITHIN_S


def _may_be_another(before: VehicleStatus, now: VehicleStatus) -> bool:
    """Whether another commander than before may be speaking of the vehicle."""
    return seconds(now.at_ns - before.at_ns) > STATUS_GAP_S or _never_heard(now)


def _never_heard(vehicle: VehicleStatus) -> bool:
    """Whether who says this knows no mode for want of a vehicle, and not because the pilot flies one that has no name here."""
    return not vehicle.connected and vehicle.mode is FlightMode.UNKNOWN


def _just_restarted(mission: MissionStatus) -> bool:
    """Whether a restarted commander may not have said yet what the vehicle does."""
    return mission.code == RESTARTED and seconds(mission.at_ns - mission.phase_since_ns) < RESTART_SETTLES_S
