"""What every camera does, whatever its source: number and stamp the frames, and repeat the calibration once a second."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from alight.runtime.clock import NS_PER_S
from alight.runtime.node import Node, Outputs, Publication
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.frame import FrameHeader, PixelFormat

Picture = NDArray[np.uint8]


class CameraNode(Node):
    """Base of the camera nodes; a subclass makes pictures."""

    service: ClassVar[str] = "camera"
    tick_period_ns: int | None = NS_PER_S

    def __init__(self, calibration: CameraCalibration) -> None:
        """Take the calibration to publish; its `at_ns` is replaced."""
        super().__init__()
        self._calibration = calibration
        self._calibration_due_ns = 0
        self._sequence = 0

    def on_tick(self, now_ns: int) -> Outputs:
        """Publish the calibration when it is due."""
        if now_ns < self._calibration_due_ns:
            return []
        self._calibration_due_ns = now_ns + NS_PER_S
        return [Publication(topics.CALIBRATION, self._calibration.model_copy(update={"at_ns": now_ns}))]

    def _frame(
        self,
        picture: Picture,
        captured_at_ns: int,
        source: str,
        exposure_s: float = 0.0,
        release_at_ns: int | None = None,
    ) -> Publication:
        """The next frame, ready to publish."""
        colour = picture.ndim == 3
        header = FrameHeader(
            captured_at_ns=captured_at_ns,
            sequence=self._sequence,
            width_px=picture.shape[1],
            height_px=picture.shape[0],
            pixel_format=PixelFormat.BGR8 if colour else PixelFormat.MONO8,
            exposure_s=exposure_s,
            source=source,
        )
        self._sequence += 1
        return Publication(topics.FRAME, header, pixels=np.ascontiguousarray(picture), release_at_ns=release_at_ns)

    def counters(self) -> dict[str, int]:
        """How many frames there were."""
        return {"frames": self._sequence}
