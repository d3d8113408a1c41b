"""A camera that plays pictures from a source at a steady rate."""

from alight.runtime.clock import NS_PER_S
from alight.runtime.node import Outputs
from schemas.calibration import CameraCalibration
from services.camera.calibration_file import CalibrationError, scaled_to
from services.camera.node import CameraNode
from services.camera.picture_source import PictureSource, SourcedPicture


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
        picture = self._source.next_picture()
        if picture is not None:
            self._fit_calibration(picture)
        outputs = list(super().on_tick(now_ns))
        if picture is not None:
            outputs.append(self._frame(picture.pixels, now_ns, picture.name[:500]))
        return outputs

    def _fit_calibration(self, picture: SourcedPicture) -> None:
        """Scale it to a picture of another size, and say so; where shapes differ, the detector refuses the frames."""
        height_px, width_px = picture.pixels.shape[:2]
        given = (self._given.width_px, self._given.height_px)
        fitting = self._given
        self._wrong_size = ""
        if (width_px, height_px) != given:
            different = f"{picture.name} is {width_px}x{height_px}, the calibration is for {given[0]}x{given[1]}"
            try:
                fitting = scaled_to(self._given, width_px, height_px)
                self._wrong_size = (
                    f"{different}: scaled, which is right if the camera bins its pixels, wrong if it crops"
                )
            except CalibrationError:
                self._wrong_size = f"{different}, which has another shape: correct camera.calibration"
        if fitting != self._calibration:
            self._calibration = fitting
            self._calibration_due_ns = 0

    def counters(self) -> dict[str, int]:
        """Frames so far, and files that could not be decoded."""
        return {**super().counters(), "undecodable": self._source.undecodable}

    def complaints(self, now_ns: int) -> tuple[str, ...]:  # noqa: ARG002
        """No pictures left, an undecodable one, or a calibration for another size."""
        return tuple(text[:500] for text in (self._source.complaint(), self._wrong_size) if text)

    def close(self) -> None:
        """Close the source."""
        self._source.close()
