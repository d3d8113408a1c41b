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


class DetectorSettings(Section):
    """How markers are found. Which marker is the pad stands in the section `pad`."""

    backend: str = "aided"
    """Name of the detector: `aided`, `aruco`, or one that an installed package brings (docs/detectors.md)."""
    aruco: Aruco = Aruco()
