"""Settings of the detector service."""

from typing import Self

from pydantic import Field, model_validator

from schemas.settings.section import Section


class Aruco(Section):
    """The backend `aruco`: OpenCV's square-marker detector, for ArUco and AprilTag families. Defaults are OpenCV's but for how cells are read."""

    threshold_window_min_px: int = Field(default=3, ge=3, le=999)
    """Smallest window of the adaptive threshold, pixels."""
    threshold_window_max_px: int = Field(default=23, ge=3, le=999)
    """Largest window of the adaptive threshold, pixels."""
    threshold_window_step_px: int = Field(default=10, ge=1, le=999)
    """Step between the windows, pixels. Each window costs about a third of the default's time."""
    cell_px: int = Field(default=8, ge=2, le=64)
    """How finely each cell is sampled to read it, pixels. OpenCV's default of 4 loses small markers: at 24 m it reads half as many."""
    cell_margin: float = Field(default=0.25, ge=0.0, lt=0.5)
    """Part of a cell's width beside each of its edges that is not read, because its neighbours leak into it. OpenCV: 0.13."""
    refine_edges: bool = True
    """Fit lines to the marker's edges for sharper corners; off leaves the corners as OpenCV's contours give them."""
    track: bool = True
    """Search around the place of the pad in the last frame first, and in the whole frame only where that fails."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.threshold_window_max_px < self.threshold_window_min_px:
            raise ValueError("threshold_window_max_px must not be below threshold_window_min_px")
        return self


class AprilTag(Section):
    """The backend `apriltag`: the AprilTag 3 library, for AprilTag families. Defaults see as far as the library can."""

    decimate: float = Field(default=1.0, ge=1.0, le=8.0)
    """Look for squares in a picture that is smaller by this factor, and read codes in the whole one: 2 takes less than half the time
    and loses a third of the range."""
    blur_sigma_px: float = Field(default=0.0, ge=0.0, le=10.0)
    """Blur the picture before squares are looked for, against strong noise: standard deviation, pixels."""
    sharpening: float = Field(default=0.25, ge=0.0, le=10.0)
    """How much small codes are sharpened before they are read. The library's default; without it, every other marker of 13 to 15 pixels is lost."""
    most_wrong_bits: int = Field(default=1, ge=0, le=2)
    """Refuse codes that differ from a marker's in more bits than this; the library allows 2."""
    least_margin: float = Field(default=10.0, ge=0.0, le=255.0)
    """Refuse codes whose cells differ less, on average, from what would read as the other colour: the library's decision margin, grey levels."""
    refine_edges: bool = True
    """Fit lines to the marker's edges, bent as the lens bends them; off leaves the corners as the library gives them."""


class Yolo(Section):
    """The backend `yolo`: an ONNX model proposes where the pad may be, and what `aided` verifies there counts."""

    model: str = Field(default="", max_length=500)
    """File of the model. What it has to take and give: docs/detectors.md."""
    least_score: float = Field(default=0.2, gt=0.0, le=1.0)
    """Boxes with a smaller score are not looked at."""
    most_boxes: int = Field(default=6, ge=1, le=50)
    """How many boxes of a frame are looked at, the best first. Each costs a few milliseconds where things look like a pad."""
    least_sides_a_box: float = Field(default=0.72, gt=0.0, le=100.0)
    """How long the model's boxes are at least, in sides of the pad's largest marker: the root of width times height. Boxes around a marker's four corners
    are 1 to 1.41, around a board of 1.5 sides 1.5 to 2.1; those of models trained with `python -m station.train_yolo` mean to be 1, whichever way it is turned."""
    most_sides_a_box: float = Field(default=1.41, gt=0.0, le=100.0)
    """How long they are at most. A box is looked at once for every factor of 1.4 between the two."""
    threads: int = Field(default=1, ge=1, le=64)
    """Threads that the model runs on. The last digits of its scores may depend on how many."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.most_sides_a_box < self.least_sides_a_box:
            raise ValueError("most_sides_a_box must not be below least_sides_a_box")
        return self


class DetectorSettings(Section):
    """How markers are found. Which marker is the pad stands in the section `pad`."""

    backend: str = "aided"
    """Name of the detector: `aided`, `aruco`, `apriltag`, `charuco`, `yolo`, or one that an installed package brings (docs/detectors.md)."""
    aruco: Aruco = Aruco()
    apriltag: AprilTag = AprilTag()
    yolo: Yolo = Yolo()
