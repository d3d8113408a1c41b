"""Pictures of a pad with known corners, clutter, and other markers, for the benches of the detectors."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from alight.geometry.rotation import (
    Matrix,
    quaternion_from_euler,
    quaternion_from_R,
    quaternion_from_rotation_vector,
    quaternion_multiply,
)
from alight.markers.layout import layout_from
from alight.runtime.seed import generator
from schemas.calibration import CameraCalibration
from schemas.settings import Settings
from schemas.truth import GroundTruth
from services.camera.calibration_file import configured_calibration
from services.camera.simulated_camera import SimulatedCamera
from services.camera.viewpoint import R_ned_marker, Viewpoint
from services.detector.detector import Prior
from station.bench.clutter import strewn
from station.bench.hover import PAD

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

HEIGHT_SIGMA = 0.03
ATTITUDE_SIGMA_RAD = math.radians(0.7)
PLACE_SIGMA_M = 2.5
"""What the priors of the benches are wrong by: height as a part of it, attitude about each axis, place to each side."""

_CAMERAS = 16
_EXPOSURE_S = 0.01
_LARGEST_TILT_RAD = math.radians(15.0)
_LARGEST_SMEAR_PX = 3.0
_WIDEST_RAD = math.radians(45.0)
_TRIES = 1000
_FRAMES_PER_S = 30.0
_DESCENT_MPS = 1.0
_DRIFTING = 0.3
"""Of the sideways speeds of single pictures, how much is flown for several."""
_SWING_RAD, _SWING_RADPS = math.radians(1.0), 6.0
_WHOLE = 1.1
"""How much of the pad has to be in view, in sides of the marker."""
_EDGE_PX = 2.0
_CLEAR_PX = 12.0


@dataclass(frozen=True)
class Shot:
    """A picture and what is true of it."""

    picture: Picture
    camera: PinholeCamera
    corners_px: Array
    """(4, 2), of the pad's largest marker."""
    R_camera_marker: Matrix
    centre_camera_m: Array
    height_m: float
    """Of the camera above the pad."""


class Studio:
    """Sixteen cameras, each with its own ground, blur (0.4 to 1.0 px), noise (2 to 6 grey levels) and, every other one, the edge of a shadow."""

    def __init__(
        self,
        seed: int,
        *,
        number: int = 68,
        pads: Sequence[Mapping[str, object]] = (),
        scale: float = 1.0,
        height_px: int = 480,
    ) -> None:
        """Set the cameras up.

        Args:
            seed: Of everything random.
            number: Which marker the pad is.
            pads: Sections `pad` of the settings, one camera's after the other's, instead of that marker: of the paper's size.
            scale: Of the picture: 3 makes 1920x1440 of 640x480.
            height_px: How many of its rows there are: those about the middle.
        """
        self._random = generator(seed, "bench.detection")
        self._calibration = _scaled(configured_calibration(Settings().camera), scale, height_px)
        self.camera = PinholeCamera.from_calibration(self._calibration)
        pads = pads or ({"id": number},)
        settings = [self._settings(seed, pads[index % len(pads)], index) for index in range(_CAMERAS)]
        self._cameras = [SimulatedCamera(each, self._calibration) for each in settings]
        layout = layout_from(settings[0].pad)
        self._corners_m, self._side_m = layout.markers[0].corners_m(), layout.markers[0].side_m
        self._noises = [each.camera.simulated.optics.noise_level for each in settings]

    def _settings(self, seed: int, pad: Mapping[str, object], index: int) -> Settings:
        draw = self._random
        sunlight = {
            "shadow_depth": draw.uniform(0.3, 0.6) if index % 2 else 0.0,
            "shadow_azimuth_deg": draw.uniform(0.0, 360.0),
            "shadow_offset_m": draw.normal(),
        }
        optics = {
            "lens_blur_px": draw.uniform(0.4, 1.0),
            "noise_level": draw.uniform(2.0, 6.0),
            "exposure_s": _EXPOSURE_S,
        }
        simulated = {"optics": optics, "sunlight": sunlight}
        return Settings.model_validate(
            {"seed": seed * _CAMERAS + index, "pad": dict(pad), "camera": {"simulated": simulated}}
        )

    def shots(self, height_m: float, count: int, *, clutter: bool = False, codes: bool = True) -> Iterator[Shot]:
        """Pictures from one height: tilt 0 to 15 degrees, any heading, the whole marker anywhere in the picture, motion smear to 3 px.

        Args:
            height_m: Of the camera above the pad.
            count: How many.
            clutter: Whether things lie around the pad.
            codes: Whether there are codes that are no markers among them.
        """
        for index in range(count):
            truth, viewpoint = self._placed(height_m)
            shot = self._shot(self._cameras[index % _CAMERAS].capture(truth), viewpoint)
            if clutter:
                middle = shot.corners_px.mean(axis=0)
                reach = float(np.abs(shot.corners_px - middle).max()) * 1.5 + _CLEAR_PX
                noise, keep = self._noises[index % _CAMERAS], (*middle.tolist(), reach)
                shot = replace(shot, picture=strewn(shot.picture, self._random, noise, keep, codes=codes))
            yield shot

    def approach(self, height_m: float, frames: int) -> Iterator[Shot]:
        """Consecutive frames, a thirtieth of a second apart, of a descent at 1 m/s from a pose as of `shots`, swinging a little."""
        draw, camera = self._random, self._cameras[int(self._random.integers(_CAMERAS))]
        first, _ = self._placed(height_m)
        velocity = np.array((*first.velocity_ned_mps[:2], _DESCENT_MPS)) * (_DRIFTING, _DRIFTING, 1.0)
        swing_rad, phase_rad = draw.normal(0.0, _SWING_RAD, 2), draw.uniform(0.0, math.tau, 2)
        for number in range(frames):
            after_s = number / _FRAMES_PER_S
            swing = (swing_rad * np.sin(_SWING_RADPS * after_s + phase_rad)).tolist()
            truth = first.model_copy(
                update={
                    "velocity_ned_mps": tuple(velocity.tolist()),
                    "vehicle_from_pad_ned_m": tuple((first.vehicle_from_pad_ned_m + velocity * after_s).tolist()),
                    "q_ned_body": quaternion_multiply(first.q_ned_body, quaternion_from_rotation_vector((*swing, 0.0))),
                }
            )
            viewpoint = Viewpoint.from_truth(truth, np.eye(3))
            yield self._shot(camera.capture(truth), viewpoint)

    def _shot(self, picture: Picture, viewpoint: Viewpoint) -> Shot:
        corners = self.camera.project(viewpoint.in_camera(self._corners_m))
        centre_m = viewpoint.in_camera(np.zeros((1, 3)))[0]
        R = viewpoint.R_marker_camera.T
        return Shot(picture, self.camera, corners, R, centre_m, viewpoint.position_marker_m[2])

    def clutter(self, count: int, *, codes: bool = True) -> Iterator[Picture]:
        """Pictures of the ground without any pad, strewn with plates, frames, stripes, discs and, if wanted, codes that are no markers."""
        for index in range(count):
            height_m = float(2.0 * 30.0 ** self._random.random())
            aside_m = self._random.uniform(20.0, 40.0) * height_m
            truth = self._truth(
                (aside_m, self._random.uniform(0.0, 300.0), -height_m), self._attitude(), (0.0, 0.0, 0.0)
            )
            picture = self._cameras[index % _CAMERAS].capture(truth)
            yield strewn(picture, self._random, self._noises[index % _CAMERAS], None, codes=codes)

    def prior(self, shot: Shot, *, place: bool) -> Prior:
        """What a system could know of a shot: attitude and height, and, if wanted, the place, all with errors."""
        draw = self._random
        q_true = quaternion_from_R(R_ned_marker(0.0) @ shot.R_camera_marker.T)
        turned = quaternion_from_rotation_vector(draw.normal(0.0, ATTITUDE_SIGMA_RAD, 3).tolist())
        height_m = shot.height_m * (1.0 + draw.normal(0.0, HEIGHT_SIGMA))
        centre_px, sigma_px = None, 0.0
        if place:
            sigma_px = PLACE_SIGMA_M / float(shot.centre_camera_m[2]) * self.camera.fx_px
            x, y = self.camera.project(shot.centre_camera_m[None])[0] + draw.normal(0.0, sigma_px, 2)
            centre_px = (float(x), float(y))
        return Prior(
            height_m=height_m,
            height_sigma_m=HEIGHT_SIGMA * shot.height_m,
            q_ned_camera=quaternion_multiply(q_true, turned),
            attitude_sigma_rad=ATTITUDE_SIGMA_RAD,
            centre_px=centre_px,
            centre_sigma_px=sigma_px,
        )

    def _placed(self, height_m: float) -> tuple[GroundTruth, Viewpoint]:
        draw, half = self._random, _WHOLE * self._side_m / 2.0
        whole_m = np.array([[-half, half, 0.0], [half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0]])
        limits = np.array((self.camera.width_px, self.camera.height_px)) - 1.0 - _EDGE_PX
        for number in range(_TRIES):
            # From 1 m the whole marker is only in view from nearly above it.
            widest_rad = _WIDEST_RAD * (1.0 - number / _TRIES)
            aside_m, towards = height_m * math.tan(draw.uniform(0.0, widest_rad)), draw.uniform(0.0, math.tau)
            speed_mps = draw.uniform(0.0, _LARGEST_SMEAR_PX) * height_m / self.camera.fx_px / _EXPOSURE_S
            course = draw.uniform(0.0, math.tau)
            place = (aside_m * math.cos(towards), aside_m * math.sin(towards), -height_m)
            velocity = (speed_mps * math.cos(course), speed_mps * math.sin(course), 0.0)
            truth = self._truth(place, self._attitude(), velocity)
            viewpoint = Viewpoint.from_truth(truth, np.eye(3))
            seen = self.camera.project(viewpoint.in_camera(whole_m))
            if np.isfinite(seen).all() and (seen >= _EDGE_PX).all() and (seen <= limits).all():
                return truth, viewpoint
        raise ValueError(f"no pose at {height_m} m shows the whole marker")

    def _attitude(self) -> tuple[float, float, float]:
        draw = self._random
        tilt_rad, towards = draw.uniform(0.0, _LARGEST_TILT_RAD), draw.uniform(0.0, math.tau)
        return tilt_rad * math.cos(towards), tilt_rad * math.sin(towards), draw.uniform(-math.pi, math.pi)

    @staticmethod
    def _truth(
        place_m: tuple[float, float, float], attitude: tuple[float, float, float], velocity: tuple[float, float, float]
    ) -> GroundTruth:
        return GroundTruth(
            at_ns=1,
            vehicle_position=PAD,
            velocity_ned_mps=velocity,
            q_ned_body=quaternion_from_euler(*attitude),
            angular_velocity_body_rps=(0.0, 0.0, 0.0),
            pad_position=PAD,
            pad_azimuth_rad=0.0,
            vehicle_from_pad_ned_m=place_m,
            touching_ground=False,
        )


def _scaled(calibration: CameraCalibration, scale: float, height_px: int) -> CameraCalibration:
    if scale == 1.0 and height_px == calibration.height_px:
        return calibration
    left_out_px = (calibration.height_px * scale - height_px) / 2.0
    return calibration.model_copy(
        update={
            "width_px": round(calibration.width_px * scale),
            "height_px": height_px,
            "fx_px": calibration.fx_px * scale,
            "fy_px": calibration.fy_px * scale,
            "cx_px": (calibration.cx_px + 0.5) * scale - 0.5,
            "cy_px": (calibration.cy_px + 0.5) * scale - 0.5 - left_out_px,
        }
    )


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else math.nan


def one_thread() -> None:
    """Keep OpenCV to one thread. NumPy's matrices here are too small for more."""
    cv2.setNumThreads(1)
