"""The geolocator: where on the earth is the pad that a frame shows."""

from collections import Counter
from collections.abc import Mapping
from typing import ClassVar

from alight.markers.layout import layout_from
from alight.runtime.clock import nanoseconds
from alight.runtime.node import Arrival, Node, Outputs, Publication
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.detection import Detection
from schemas.fix import FixVerdict, PadFix
from schemas.settings import Settings
from schemas.vehicle import GimbalState, VehicleState
from services.geolocator.camera_mount import CameraMount
from services.geolocator.geolocation import Geolocation
from services.geolocator.pad_sight import pad_in
from services.geolocator.pose_history import PoseHistory
from services.geolocator.refusal import FixRefusedError
from services.geolocator.view import view_from

_COMPLAIN_AFTER = 10


class Geolocator(Node):
    """Answers every detection at once with a fix, or with the reason why there is none.

    It never waits for a later pose: a capture that is newer than the newest pose is extrapolated within limits, or refused.
    """

    service: ClassVar[str] = "geolocator"
    answers_at_once = True

    def __init__(self, settings: Settings) -> None:
        super().__init__()
        self._layout = layout_from(settings.pad)
        self._settings = settings.geolocator
        self._poses = PoseHistory(self._settings.lookup, self._settings.uncertainty)
        self._mount = CameraMount(self._settings.mount, self._settings.lookup)
        self._geolocation = Geolocation(self._settings)
        self._latency_ns = nanoseconds(self._settings.correction.extrinsic.image_latency_s)
        self._calibration: CameraCalibration | None = None
        self._newest_capture_ns = -1
        self._counters: Counter[str] = Counter()
        self._refused_in_a_row = 0
        self._last_refusal = ""
        self.subscribe(topics.CALIBRATION, self._on_calibration)
        self.subscribe(topics.VEHICLE_STATE, self._on_vehicle_state)
        self.subscribe(topics.GIMBAL_STATE, self._on_gimbal_state)
        self.subscribe(topics.DETECTION, self._on_detection)

    def counters(self) -> Mapping[str, int]:
        """Fixes by verdict, and vehicle and gimbal states that were nonsense."""
        attitude = self._geolocation.attitude
        refused = {"heading_refused": attitude.heading_refused, "tilt_refused": attitude.tilt_refused}
        return {**self._counters, **{name: count for name, count in refused.items() if count}}

    def complaints(self, now_ns: int) -> tuple[str, ...]:  # noqa: ARG002
        """Says so if detections of the pad keep being refused."""
        if self._refused_in_a_row < _COMPLAIN_AFTER:
            return self._geolocation.attitude.complaints()
        return (f"the last {self._refused_in_a_row} detections gave no fix: {self._last_refusal}",)

    def _on_calibration(self, arrival: Arrival[CameraCalibration]) -> Outputs:
        self._calibration = arrival.message
        return ()

    def _on_vehicle_state(self, arrival: Arrival[VehicleState]) -> Outputs:
        if not self._poses.add(arrival.message):
            self._counters["vehicle_state_refused"] += 1
        return ()

    def _on_gimbal_state(self, arrival: Arrival[GimbalState]) -> Outputs:
        if not self._mount.add(arrival.message):
            self._counters["gimbal_state_refused"] += 1
        return ()

    def _on_detection(self, arrival: Arrival[Detection]) -> Outputs:
        detection = arrival.message
        try:
            fix = self._located(detection, arrival.now_ns)
        except FixRefusedError as refusal:
            fix = _refused(detection, refusal.verdict, refusal.detail, arrival.now_ns)
        except (ValueError, ArithmeticError) as error:
            # NaN and infinity end here, too: neither the arithmetic nor the message type lets them pass.
            fix = _refused(detection, FixVerdict.NOT_FINITE, str(error).splitlines()[0][:200], arrival.now_ns)
        self._count(fix)
        return (Publication(topics.PAD_FIX, fix),)

    def _located(self, detection: Detection, now_ns: int) -> PadFix:
        captured_at_ns = detection.captured_at_ns
        if captured_at_ns <= self._newest_capture_ns:
            raise FixRefusedError(FixVerdict.OUT_OF_ORDER, "captured no later than the detection before")
        self._newest_capture_ns = captured_at_ns
        pad = pad_in(detection, self._layout)
        if self._calibration is None:
            raise FixRefusedError(FixVerdict.NO_CALIBRATION, "no camera calibration has come yet")
        seen_at_ns = captured_at_ns + nanoseconds(pad.rows_after_s)
        looked_at_ns = seen_at_ns if self._settings.lookup.pose == "capture" else self._poses.newest_ns(captured_at_ns)
        latency_s = self._settings.lookup.image_latency_s if self._settings.lookup.pose == "capture" else 0.0
        mount, installation = self._mount, self._geolocation.installation
        believed_ns, by_gimbal = looked_at_ns - nanoseconds(latency_s), mount.is_measured
        q_body_camera = mount.q_body_camera(believed_ns)
        believed = view_from(self._poses.at(believed_ns), q_body_camera, mount.camera_in_body_m, by_gimbal=by_gimbal)
        true = believed
        if installation is not None:
            light_ns = looked_at_ns - self._latency_ns
            true = view_from(
                self._poses.at(light_ns),
                installation.q_body_camera(mount.q_body_camera(light_ns)),
                installation.camera_in_body_m(mount.camera_in_body_m),
                by_gimbal=by_gimbal,
            )
        return self._geolocation.fix(detection, pad, believed, true, self._calibration, now_ns=now_ns)

    def _count(self, fix: PadFix) -> None:
        self._counters[f"fix_{fix.verdict}"] += 1
        if fix.verdict is FixVerdict.ACCEPTED:
            self._refused_in_a_row = 0
        elif fix.verdict is not FixVerdict.NO_MARKER:
            self._refused_in_a_row += 1
            self._last_refusal = f"{fix.verdict}, {fix.detail}"


def _refused(detection: Detection, verdict: FixVerdict, detail: str, now_ns: int) -> PadFix:
    return PadFix(
        captured_at_ns=detection.captured_at_ns,
        hops=detection.hops,
        verdict=verdict,
        detail=detail,
        latency_s=(now_ns - detection.captured_at_ns) * 1e-9,
    )
