"""A plausible landing, made up: every topic, at its usual rate, with known errors. No service runs."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np

from alight.geometry.camera import PinholeCamera
from alight.geometry.frames import Q_BODY_GIMBAL_DOWN, camera_from_ned
from alight.geometry.local import moved_by_ned
from alight.runtime.clock import LOCKSTEP_EPOCH_NS, nanoseconds
from alight.runtime.node import Arrival
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.detection import Detection, Marker, MarkerPose
from schemas.estimate import PadEstimate
from schemas.fix import FixVerdict, PadFix, PadPosition
from schemas.frame import FrameHeader
from schemas.fusion import Fusion, FusionAttempt, FusionVerdict
from schemas.health import Health, InputHealth, OutputHealth
from schemas.message import GlobalPosition, Hop, Message
from schemas.mission import MissionReply, MissionRequest, MissionStatus, Phase, Verb
from schemas.setpoint import Setpoint, SetpointKind
from schemas.settings import Settings
from schemas.topics import Topic
from schemas.truth import GroundTruth
from schemas.vehicle import FlightMode, GimbalState, LandedState, VehicleState, VehicleStatus
from services.recorder.flight_file import FlightFile
from services.recorder.node import Recorder
from station.flight_record import FlightRecord, Logged, Provenance

START_NS = LOCKSTEP_EPOCH_NS
PAD = GlobalPosition(latitude_deg=47.3977, longitude_deg=8.5456, altitude_amsl_m=488.0, ellipsoidal_height_m=535.5)
START_NED_M = np.array([10.0, 10.0, -20.0])
REST_NED_M = np.array([0.03, -0.02, -0.15])
NAVIGATION_ERROR_NED_M = np.array([0.4, -0.3, 0.2])
RAW_ERROR_PER_M = 0.025
DESCENT_S, TOUCHDOWN_S, CONTACT_S, LANDED_S, END_S = 2.0, 15.0, 17.0, 19.0, 20.0
CALIBRATION = CameraCalibration(
    at_ns=START_NS, width_px=640, height_px=480, fx_px=293.35, fy_px=293.31, cx_px=319.64, cy_px=239.64, source="paper"
)
HALF_SIDE_M = 0.5
LEVEL = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Spoken:
    """A message, when it was heard, and its pixels."""

    at_ns: int
    topic: Topic[Message]
    message: Message
    pixels: np.ndarray | None = None


@dataclass(frozen=True)
class Flight:
    """What may differ from a good landing."""

    rest_ned_m: tuple[float, float, float] = tuple(REST_NED_M)
    abort_at_s: float | None = None
    commander_restarts_at_s: float | None = None
    with_truth: bool = True
    paint_every: int = 0
    """Every how many frames have pixels; 0 for none."""

    @property
    def end_ns(self) -> int:
        """When the record ends."""
        return _ns(END_S if self.abort_at_s is None else self.abort_at_s + 2.0)

    def spoken(self) -> tuple[Spoken, ...]:
        """Everything said during the flight, in order."""
        return _spoken(self)

    def record(self) -> FlightRecord:
        """The same as if read from a recording without pictures."""
        entries = [(one.topic.name, Logged(one.message, one.at_ns)) for one in self.spoken()]
        settings = {"pad": {"family": "5x5_1000", "id": 68, "side_m": 1.0}, "seed": 7}
        return FlightRecord(entries, Provenance({"alight": "0.1.0"}, settings))

    def write(self, directory: Path, **recorder: object) -> Path:
        """Let the recorder write it; returns the file."""
        settings = Settings.model_validate({"seed": 7, "recorder": {"directory": directory, **recorder}})
        node = Recorder(settings, FlightFile(settings))
        for number, one in enumerate(self.spoken()):
            node.on_message(Arrival(one.topic, one.message, one.at_ns, one.at_ns, one.pixels))
            if number % 100 == 0:
                node.on_tick(one.at_ns)
        node.close()
        return directory / "flight.mcap"

    def ned_m(self, t_s: float) -> np.ndarray:
        """True position from the pad."""
        above = np.array([self.rest_ned_m[0], self.rest_ned_m[1], -0.8])
        if t_s < TOUCHDOWN_S:
            return above + (START_NED_M - above) * (1 - _smooth((t_s - DESCENT_S) / (TOUCHDOWN_S - DESCENT_S)))
        return above + (np.array(self.rest_ned_m) - above) * _smooth((t_s - TOUCHDOWN_S) / (CONTACT_S - TOUCHDOWN_S))

    def velocity_ned_mps(self, t_s: float) -> np.ndarray:
        """True velocity."""
        return (self.ned_m(t_s + 1e-3) - self.ned_m(t_s - 1e-3)) / 2e-3

    def _truth(self) -> Iterator[Spoken]:
        for t_s in np.arange(0, END_S, 1 / 60) if self.with_truth else ():
            at_ns, ned_m = _ns(t_s), self.ned_m(t_s)
            yield Spoken(
                at_ns,
                topics.GROUND_TRUTH,
                GroundTruth(
                    at_ns=at_ns,
                    vehicle_position=moved_by_ned(PAD, ned_m),
                    velocity_ned_mps=tuple(self.velocity_ned_mps(t_s)),
                    q_ned_body=LEVEL,
                    angular_velocity_body_rps=(0.0, 0.0, 0.0),
                    pad_position=PAD,
                    pad_azimuth_rad=0.0,
                    vehicle_from_pad_ned_m=tuple(ned_m),
                    touching_ground=bool(t_s >= CONTACT_S),
                ),
            )

    def _vehicle(self) -> Iterator[Spoken]:
        noise = np.random.default_rng(1)
        for number, t_s in enumerate(np.arange(0, END_S, 0.02)):
            at_ns = _ns(t_s)
            measured_m = self.ned_m(t_s) + NAVIGATION_ERROR_NED_M + noise.normal(0, 0.002, 3)
            yield Spoken(
                at_ns + nanoseconds(0.004),
                topics.VEHICLE_STATE,
                VehicleState(
                    at_ns=at_ns,
                    position=moved_by_ned(PAD, measured_m),
                    velocity_ned_mps=tuple(self.velocity_ned_mps(t_s)),
                    q_ned_body=LEVEL,
                    angular_velocity_body_rps=(0.0, 0.0, 0.0),
                ),
            )
            if number % 10 == 0:
                on_ground = t_s >= LANDED_S
                status = VehicleStatus(
                    at_ns=at_ns,
                    connected=True,
                    armed=not on_ground,
                    mode=FlightMode.OFFBOARD,
                    landed_state=LandedState.ON_GROUND if on_ground else LandedState.IN_AIR,
                )
                gimbal = GimbalState(at_ns=at_ns, q_body_gimbal=Q_BODY_GIMBAL_DOWN, measured=False)
                yield Spoken(at_ns, topics.VEHICLE_STATUS, status)
                yield Spoken(at_ns, topics.GIMBAL_STATE, gimbal)

    def _vision(self) -> Iterator[Spoken]:
        noise = np.random.default_rng(2)
        for number, t_s in enumerate(np.arange(0, END_S, 1 / 30)):
            captured_ns, ned_m = _ns(t_s), self.ned_m(t_s)
            corners_px = pad_corners_px(ned_m)
            yield self._frame(number, captured_ns, corners_px)
            seen = _inside(corners_px) and number % 20 != 19
            detection = _detection(number, captured_ns, corners_px if seen else None, ned_m)
            yield Spoken(captured_ns + nanoseconds(0.0205), topics.DETECTION, detection)
            fix = _fix(captured_ns, ned_m + NAVIGATION_ERROR_NED_M, ned_m, noise) if seen else _no_fix(captured_ns)
            yield Spoken(captured_ns + nanoseconds(0.022), topics.PAD_FIX, fix)
            if number % 3 == 0 and fix.corrected is not None:
                yield from self._steer(captured_ns, fix, t_s)
        yield Spoken(START_NS, topics.CALIBRATION, CALIBRATION)

    def _frame(self, number: int, captured_ns: int, corners_px: np.ndarray) -> Spoken:
        header = FrameHeader(
            captured_at_ns=captured_ns,
            hops=_hops(captured_ns, 1),
            sequence=number,
            width_px=640,
            height_px=480,
            source="synthetic",
        )
        wanted = self.paint_every and number % self.paint_every == 0 and captured_ns <= self.end_ns
        pixels = painted(corners_px) if wanted else None
        return Spoken(captured_ns + nanoseconds(0.006), topics.FRAME, header, pixels)

    def _steer(self, captured_ns: int, fix: PadFix, t_s: float) -> Iterator[Spoken]:
        assert fix.corrected is not None
        estimate = PadEstimate(
            captured_at_ns=captured_ns,
            hops=_hops(captured_ns, 4),
            position=fix.corrected.position,
            pad_ned_m=fix.corrected.pad_ned_m,
            azimuth_rad=0.0,
            covariance_ned_m2=(1e-3, 0, 0, 0, 1e-3, 0, 0, 0, 1e-3),
            azimuth_variance_rad2=1e-4,
            method="mean",
            fixes_used=5,
        )
        yield Spoken(captured_ns + nanoseconds(0.0235), topics.PAD_ESTIMATE, estimate)
        attempt = FusionAttempt(name="active", method="mean", verdict=FusionVerdict.FUSED)
        fusion = Fusion(at_ns=captured_ns + nanoseconds(0.03), captured_at_ns=captured_ns, attempts=(attempt,))
        yield Spoken(fusion.at_ns, topics.FUSION, fusion)
        if not DESCENT_S <= t_s < TOUCHDOWN_S:
            return
        setpoint = Setpoint(
            captured_at_ns=captured_ns,
            hops=_hops(captured_ns, 5),
            kind=SetpointKind.OFFBOARD,
            sent_at_ns=captured_ns + nanoseconds(0.024),
            fresh=True,
            position=moved_by_ned(PAD, self.ned_m(t_s + 0.5) + NAVIGATION_ERROR_NED_M),
            yaw_ned_rad=0.0,
            reason="descend",
        )
        yield Spoken(captured_ns + nanoseconds(0.025), topics.SETPOINT, setpoint)

    def _mission(self) -> Iterator[Spoken]:
        for t_s in np.arange(0, END_S, 0.2):
            began_s, phase, code, reason = self._phase(t_s)
            status = MissionStatus(
                at_ns=_ns(t_s),
                phase=phase,
                phase_since_ns=_ns(began_s),
                reason=reason,
                code=code,
                guidance="glide",
                height_above_pad_m=-float(self.ned_m(t_s)[2]),
                request_id="land-1",
            )
            yield Spoken(_ns(t_s), topics.MISSION_STATUS, status)

    def _phase(self, t_s: float) -> tuple[float, Phase, str, str]:
        if self.abort_at_s is not None and t_s >= self.abort_at_s:
            return self.abort_at_s, Phase.ABORTED, "asked", "abort asked for by a person"
        if t_s < DESCENT_S:
            return 0.0, Phase.ACQUIRE, "asked", "landing asked for"
        if t_s < TOUCHDOWN_S:
            return DESCENT_S, Phase.DESCEND, "estimate_good", "estimate within 0.10 m"
        if t_s < LANDED_S:
            return TOUCHDOWN_S, Phase.TOUCHDOWN, "below_switching_height", "height 0.80 m is below 0.80 m"
        return LANDED_S, Phase.LANDED, "disarmed", "on the ground, disarmed"

    def _health(self) -> Iterator[Spoken]:
        for t_s in np.arange(1, END_S, 1.0):
            for service in sorted(topics.SERVICES):
                yield Spoken(_ns(t_s), topics.HEALTH, self._report(service, float(t_s)))

    def _report(self, service: str, t_s: float) -> Health:
        restart_s = self.commander_restarts_at_s if service == "commander" else None
        born_s = restart_s if restart_s is not None and t_s >= restart_s else 0.0
        estimate = InputHealth(
            topic="filter/estimate", received=10, rate_hz=10.0, dropped=0, refused={}, age_s=0.05, stale=False
        )
        return Health(
            at_ns=_ns(t_s),
            service=service,
            pid=0,
            uptime_s=t_s - born_s,
            inputs=(estimate,),
            outputs=(OutputHealth(topic="commander/setpoint", published=10, rate_hz=10.0),),
            counters={"handler_errors": 0},
            complaints=("filter/estimate silent for 1.2 s",) if restart_s is not None and t_s == restart_s else (),
        )


@cache
def _spoken(flight: Flight) -> tuple[Spoken, ...]:
    parts = (flight._truth(), flight._vehicle(), flight._vision(), flight._mission(), flight._health(), _requests())
    said = [one for part in parts for one in part if one.at_ns <= flight.end_ns]
    return tuple(sorted(said, key=lambda one: one.at_ns))


def pad_corners_px(vehicle_from_pad_ned_m: np.ndarray) -> np.ndarray:
    """Where the print's corners appear: upper left, upper right, lower right, lower left."""
    half = HALF_SIDE_M
    corners_ned_m = np.array([[half, -half, 0], [half, half, 0], [-half, half, 0], [-half, -half, 0]])
    camera_m = [camera_from_ned(tuple(corner - vehicle_from_pad_ned_m), LEVEL) for corner in corners_ned_m]
    return PinholeCamera.from_calibration(CALIBRATION).project(np.array(camera_m))


def painted(corners_px: np.ndarray) -> np.ndarray:
    """The pad on a mottled ground."""
    noise = np.random.default_rng(3)
    ground = cv2.resize(noise.integers(70, 150, (60, 80)).astype(np.uint8), (640, 480), interpolation=cv2.INTER_CUBIC)
    if not np.all(np.isfinite(corners_px)):
        return ground
    marker = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_1000), 68, 700)
    sheet = cv2.copyMakeBorder(marker, 100, 100, 100, 100, cv2.BORDER_CONSTANT, value=255)
    print_px = np.array([[100, 100], [800, 100], [800, 800], [100, 800]], np.float32)
    turn = cv2.getPerspectiveTransform(print_px, corners_px.astype(np.float32))
    pad = cv2.warpPerspective(sheet, turn, (640, 480), flags=cv2.INTER_AREA)
    mask = cv2.warpPerspective(np.full_like(sheet, 255), turn, (640, 480))
    return np.where(mask > 0, pad, ground).astype(np.uint8)


def _ns(t_s: float) -> int:
    return START_NS + nanoseconds(float(t_s))


def _smooth(fraction: float) -> float:
    x = min(1.0, max(0.0, fraction))
    return x * x * (3 - 2 * x)


def _inside(corners_px: np.ndarray) -> bool:
    return bool(np.all(corners_px > 0) and np.all(corners_px < (640, 480)))


def _hops(captured_ns: int, count: int) -> tuple[Hop, ...]:
    """Camera 6 ms; then 0.5 ms on the way, 0.25 ms in the queue, and 12, 1, 0.5 and 0.5 ms at work."""
    hops, out_ns = [], captured_ns + nanoseconds(0.006)
    hops.append(Hop(service="camera", received_at_ns=captured_ns, handled_at_ns=captured_ns, published_at_ns=out_ns))
    for service, work_s in (("detector", 0.012), ("geolocator", 0.001), ("filter", 0.0005), ("commander", 0.0005)):
        received_ns = out_ns + nanoseconds(0.0005)
        handled_ns = received_ns + nanoseconds(0.00025)
        out_ns = handled_ns + nanoseconds(work_s)
        hops.append(Hop(service=service, received_at_ns=received_ns, handled_at_ns=handled_ns, published_at_ns=out_ns))
    return tuple(hops[:count])


def _detection(number: int, captured_ns: int, corners_px: np.ndarray | None, ned_m: np.ndarray) -> Detection:
    pose = MarkerPose(
        position_camera_m=camera_from_ned(tuple(-ned_m), LEVEL),
        q_camera_marker=(0.0, 1.0, 0.0, 0.0),
        reprojection_error_px=0.1,
        covariance=tuple(np.eye(6).ravel() * 1e-4),
    )
    marker = None
    if corners_px is not None:
        marker = Marker(
            family="5x5_1000",
            id=68,
            side_m=1.0,
            corners_px=tuple((float(x), float(y)) for x, y in corners_px),
            corner_sigma_px=0.2,
            poses=(pose,),
            ambiguity=0.2,
        )
    return Detection(
        captured_at_ns=captured_ns,
        hops=_hops(captured_ns, 2),
        frame_sequence=number,
        detector="aruco",
        markers=() if marker is None else (marker,),
    )


def _fix(captured_ns: int, navigation_ned_m: np.ndarray, ned_m: np.ndarray, noise: np.random.Generator) -> PadFix:
    corrected_m = -ned_m + noise.normal(0, 0.002 * -ned_m[2], 3)
    raw_m = corrected_m + RAW_ERROR_PER_M * -ned_m[2] * np.array([1.0, 0.5, 1.0])
    vehicle = moved_by_ned(PAD, navigation_ned_m)
    return PadFix(
        captured_at_ns=captured_ns,
        hops=_hops(captured_ns, 3),
        verdict=FixVerdict.ACCEPTED,
        raw=PadPosition(pad_ned_m=tuple(raw_m), position=moved_by_ned(vehicle, raw_m), azimuth_rad=0.0),
        corrected=PadPosition(
            pad_ned_m=tuple(corrected_m), position=moved_by_ned(vehicle, corrected_m), azimuth_rad=0.0
        ),
        covariance_ned_m2=(1e-3, 0, 0, 0, 1e-3, 0, 0, 0, 1e-3),
        azimuth_variance_rad2=1e-4,
        vehicle_position=vehicle,
        latency_s=0.022,
    )


def _no_fix(captured_ns: int) -> PadFix:
    return PadFix(
        captured_at_ns=captured_ns,
        hops=_hops(captured_ns, 3),
        verdict=FixVerdict.NO_MARKER,
        detail="no 5x5_1000 id 68 among 0 markers",
    )


def _requests() -> Iterator[Spoken]:
    request = MissionRequest(at_ns=START_NS, request_id="land-1", verb=Verb.LAND)
    reply = MissionReply(at_ns=START_NS + 1, request_id="land-1", accepted=True, reason="landing")
    yield Spoken(START_NS, topics.REQUEST, request)
    yield Spoken(START_NS + 1, topics.REPLY, reply)
