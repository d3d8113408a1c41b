"""A camera that plays pictures from a source at a steady rate."""

from alight.runtime.clock import NS_PER_S
from alight.runtime.node import Outputs, Publication
from schemas import topics
from schemas.calibration import CameraCalibration
from services.camera.calibration_file import CalibrationError, scaled_to
from services.camera.node import CameraNode
from services.camera.picture_source import PictureSource


class PlayedCameraNode(CameraNode):
    """Publishes the source's next picture on every tick, stamped with the tick's time."""

    def __init__(self, source: PictureSource, calibration: CameraCalibration, rate_hz: float) -> None:
        """Take the source.

        Args:
            source: Where pictures come from; closed with the node.
            calibration: Of the camera that took them.
            rate_hz: Pictures a second.
        """
        super().__init__(calibration)
        self._given = calibration
        self.tick_period_ns = round(NS_PER_S / rate_hz)
        self._source = source
        self._wrong_size = ""

    def on_tick(self, now_ns: int) -> Outputs:
        """Publish the next picture, and the calibration when it is due."""
        outputs = list(super().on_tick(now_ns))
        picture = self._source.next_picture()
        if picture is None:
            return outputs
        height, width = picture.pixels.shape[:2]
        if (width, height) != (self._calibration.width_px, self._calibration.height_px):
            outputs.extend(self._fit_calibration(picture.name, width, height, now_ns))
        outputs.append(self._frame(picture.pixels, now_ns, picture.name[:500]))
        return outputs

    def _fit_calibration(self, name: str, width_px: int, height_px: int, now_ns: int) -> Outputs:
        """Scale it to a picture of another size, and say so; where shapes differ, the detector refuses the frames."""
        believed = f"{self._given.width_px}x{self._given.height_px}"
        different = f"{name} is {width_px}x{height_px}, the calibration is for {believed}"
        try:
            self._calibration = scaled_to(self._given, width_px, height_px)
        except CalibrationError:
            self._wrong_size = f"{different}, which has another shape: correct camera.calibration"
            return []
        self._wrong_size = f"{different}: scaled, which is right if the camera bins its pixels and wrong if it crops"
        return [Publication(topics.CALIBRATION, self._calibration.model_copy(update={"at_ns": now_ns}))]

    def counters(self) -> dict[str, int]:
        """Frames so far, and files that could not be decoded."""
        return {**super().counters(), "undecodable": self._source.undecodable}

    def complaints(self, now_ns: int) -> tuple[str, ...]:  # noqa: ARG002
        """No pictures left, an undecodable one, or a calibration for another size."""
        return tuple(text[:500] for text in (self._source.complaint(), self._wrong_size) if text)

    def close(self) -> None:
        """Close the source."""
        self._source.close()
