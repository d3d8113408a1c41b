"""The camera of a simulated vehicle: renders a frame from the ground truth whenever one is due."""

from alight.runtime.clock import NS_PER_S, nanoseconds
from alight.runtime.node import Arrival, Outputs
from alight.runtime.seed import generator
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.settings import Settings
from schemas.truth import GroundTruth
from services.camera.node import CameraNode
from services.camera.picture_faults import PictureFaults
from services.camera.simulated_camera import SimulatedCamera

_SHARE_OF_LEAD = 1.0 / 3.0
MAX_LATE_NS = nanoseconds(0.1)
"""Where the truth comes with no lead, as from a simulation that runs elsewhere."""


class SimulatedCameraNode(CameraNode):
    """Takes the ground truth, which comes ahead of its time, and keeps each frame back until its light has hit the sensor.

    A real camera loses frames, it does not deliver them late. So a machine too slow to draw them all leaves some out: those that
    cannot be begun before a third of the truth's lead has gone.
    """

    def __init__(self, settings: Settings, calibration: CameraCalibration) -> None:
        """Build the camera.

        Raises:
            FamilyError: If the pad's marker does not exist.
        """
        super().__init__(calibration)
        self._camera = SimulatedCamera(settings, calibration)
        self._period_ns = round(NS_PER_S / settings.camera.rate_hz)
        self._slack_ns = nanoseconds(0.25 / max(settings.simulator.truth_hz, settings.camera.rate_hz))
        self._latency_ns = nanoseconds(settings.simulator.installation.image_latency_s)
        self._delay_ns = nanoseconds(settings.camera.simulated.delay_s)
        self._exposure_s = settings.camera.simulated.optics.exposure_s
        self._faults = PictureFaults(settings.camera.simulated.faults, generator(settings.seed, "camera.faults"))
        self._latest_start_ns = _latest_start_ns(settings)
        self._due_ns: int | None = None
        self._skipped = 0
        self.subscribe(topics.GROUND_TRUTH, self._on_truth)

    def prepare(self) -> None:
        """Do before the flight what would make a frame late in it."""
        self._camera.draw_all()

    def _on_truth(self, arrival: Arrival[GroundTruth]) -> Outputs:
        truth = arrival.message
        if not self._is_due(truth.at_ns):
            return []
        if arrival.now_ns - truth.at_ns > self._latest_start_ns:
            self._skipped += 1
            return []
        picture = self._faults.applied(self._camera.capture(truth))
        if picture is None:
            return []
        # The installation's latency is an error that nobody knows of: the stamp is later than the light.
        stamp_ns = truth.at_ns + self._latency_ns
        return [self._frame(picture, stamp_ns, "simulated", self._exposure_s, stamp_ns + self._delay_ns)]

    def counters(self) -> dict[str, int]:
        """How many frames there were, how many were left out for want of time, and what faults befell the others."""
        faults = {"frames_dropped": self._faults.dropped, "frames_shifted": self._faults.shifted}
        return {**super().counters(), "frames_skipped": self._skipped, **faults}

    def _is_due(self, at_ns: int) -> bool:
        """Whether this truth makes a frame. After a gap the rhythm starts anew instead of catching up."""
        if self._due_ns is None or abs(at_ns - self._due_ns) > 2 * self._period_ns:
            self._due_ns = at_ns
        if at_ns < self._due_ns - self._slack_ns:
            return False
        self._due_ns += self._period_ns
        return True


def _latest_start_ns(settings: Settings) -> int:
    """When a drawing has to begin at the latest, after the time that it shows; below zero is before."""
    simulator = settings.simulator
    if simulator.kind != "embedded" or simulator.lead_s == 0.0:
        return MAX_LATE_NS
    return -nanoseconds((1.0 - _SHARE_OF_LEAD) * simulator.lead_s)
