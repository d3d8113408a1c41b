"""Rendered pads with known corners, for detectors."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from alight.geometry.camera import PinholeCamera
from alight.markers.layout import layout_from
from schemas.settings import Settings
from services.camera.calibration_file import configured_calibration
from services.camera.simulated_camera import SimulatedCamera
from services.camera.viewpoint import Viewpoint
from services.detector.square_pose import square_points_m


@dataclass(frozen=True)
class RenderedPad:
    """A picture and what is true of it."""

    picture: np.ndarray
    corners_px: np.ndarray
    centre_camera_m: np.ndarray
    R_camera_marker: np.ndarray


class PadStudio:
    """Takes pictures of a pad, in even light unless the settings say otherwise; the corners are those of the paper's single marker."""

    def __init__(self, truth_at, settings: Settings) -> None:
        calibration = configured_calibration(settings.camera)
        self.camera = PinholeCamera.from_calibration(calibration)
        self.layout = layout_from(settings.pad)
        self._simulated = SimulatedCamera(settings, calibration)
        self._truth_at = truth_at

    def shoot(self, *place, **more) -> RenderedPad:
        truth = self._truth_at(*place, **more)
        viewpoint = Viewpoint.from_truth(truth, np.eye(3))
        corners_m = viewpoint.in_camera(square_points_m(1.0))
        return RenderedPad(
            self._simulated.capture(truth),
            self.camera.project(corners_m),
            viewpoint.in_camera(np.zeros((1, 3)))[0],
            viewpoint.R_marker_camera.T,
        )

    def shoot_at_random(self, height_m: float, number: int) -> RenderedPad:
        random = np.random.default_rng([number, round(height_m * 1000)])
        north_m, east_m = random.normal(0.0, 0.1 * height_m, 2)
        roll, pitch = random.normal(0.0, 0.06, 2)
        return self.shoot(north_m, east_m, -height_m, (roll, pitch, random.uniform(-3.0, 3.0)))


@pytest.fixture
def shaded_studio(truth_at) -> Callable[[float], PadStudio]:
    """By how far the edge of a shadow runs off the pad's centre, metres."""
    return lambda offset_m: PadStudio(
        truth_at,
        Settings.model_validate(
            {"camera": {"simulated": {"sunlight": {"shadow_depth": 0.6, "shadow_offset_m": offset_m}}}}
        ),
    )


@pytest.fixture
def studio(truth_at) -> PadStudio:
    return PadStudio(truth_at, Settings())


@pytest.fixture
def studio_with(truth_at):
    """A studio for another pad: `studio_with(family="apriltag_36h11", id=5)`."""
    return lambda **pad: PadStudio(truth_at, Settings.model_validate({"pad": pad}))
