"""Which of the two poses that a flat pad's picture allows is its true one."""

import math
from typing import NamedTuple

from alight.geometry.flat_matrix import transposed_times
from alight.geometry.rotation import quaternion_multiply, quaternion_normalised
from schemas.detection import MarkerPose, PadView
from schemas.fix import FixVerdict
from schemas.message import Quaternion
from services.geolocator.refusal import FixRefusedError
from services.geolocator.view import View


class PlanarSolution(NamedTuple):
    """One planar solution in the light of the vehicle's attitude."""

    pose: MarkerPose
    number: int
    """Its place among the poses of the detection, from 1."""
    q_ned_marker: Quaternion
    tilt_rad: float
    """Between the print's normal and the vertical."""
    allowed_tilt_rad: float
    """The tilt up to which the print may be a level pad for all that the picture can tell."""
    badness: float
    """Squared reprojection error and squared tilt, each in its standard deviations; smaller is likelier."""


def choose(pad: PadView, view: View, max_pad_tilt_rad: float, attitude_sigma_rad: float) -> PlanarSolution:
    """The likelier solution among those that show a level pad in front of the camera.

    The picture speaks through the reprojection errors, the prior through the tilt. How loud the prior speaks depends on
    how well the picture shows a tilt at all: the orientation covariance of the pose, the attitude's uncertainty, and the
    tilt whose foreshortening the corner noise hides (a square of s pixels tilted by t shrinks by s t^2 / 2, which is
    flat at t = 0, so the linear covariance alone is too sure of itself far away). A small picture of a level pad is
    therefore not refused for the wild tilt that it seems to have.

    Raises:
        FixRefusedError: BEHIND_CAMERA or NOT_LEVEL if no solution is left.
        ValueError: If an orientation is no rotation.
    """
    ahead = [(number, pose) for number, pose in enumerate(pad.poses, 1) if pose.position_camera_m[2] > 0.0]
    if not ahead:
        raise FixRefusedError(FixVerdict.BEHIND_CAMERA, f"depth {pad.poses[0].position_camera_m[2]:.3f} m")
    hidden_rad = math.sqrt(6.0 * pad.corner_sigma_px / pad.extent_px)
    noise_px = max(pad.corner_sigma_px, ahead[0][1].reprojection_error_px)
    solutions = [
        _judged(pose, number, view, max_pad_tilt_rad, attitude_sigma_rad, hidden_rad=hidden_rad, noise_px=noise_px)
        for number, pose in ahead
    ]
    level = [solution for solution in solutions if solution.tilt_rad <= solution.allowed_tilt_rad]
    if not level:
        tilts = " and ".join(
            f"{math.degrees(s.tilt_rad):.1f} deg (at most {math.degrees(s.allowed_tilt_rad):.1f})" for s in solutions
        )
        raise FixRefusedError(FixVerdict.NOT_LEVEL, f"tilt of the pad {tilts}")
    return min(level, key=lambda solution: solution.badness)


def _judged(
    pose: MarkerPose,
    number: int,
    view: View,
    max_pad_tilt_rad: float,
    attitude_sigma_rad: float,
    *,
    hidden_rad: float,
    noise_px: float,
) -> PlanarSolution:
    q_ned_marker = quaternion_multiply(view.q_ned_camera, quaternion_normalised(pose.q_camera_marker))
    w, x, y, z = q_ned_marker
    normal_n, normal_e, normal_d = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)
    horizontal = math.hypot(normal_n, normal_e)
    tilt_rad = math.atan2(horizontal, -normal_d)
    axis_ned = (-normal_e / horizontal, normal_n / horizontal, 0.0) if horizontal > 0.0 else (1.0, 0.0, 0.0)
    a, b, c = transposed_times(view.R_ned_camera, axis_ned)
    C = pose.covariance
    tilt_variance = (
        a * (a * C[21] + b * C[22] + c * C[23])
        + b * (a * C[27] + b * C[28] + c * C[29])
        + c * (a * C[33] + b * C[34] + c * C[35])
    )
    unknown2 = 9.0 * (max(tilt_variance, 0.0) + attitude_sigma_rad**2) + hidden_rad**2
    return PlanarSolution(
        pose=pose,
        number=number,
        q_ned_marker=q_ned_marker,
        tilt_rad=tilt_rad,
        # A print is not seen from behind, however little the picture tells.
        allowed_tilt_rad=min(max_pad_tilt_rad + math.sqrt(unknown2), math.pi / 2),
        badness=4.0 * (pose.reprojection_error_px / noise_px) ** 2
        + 9.0 * tilt_rad**2 / (max_pad_tilt_rad**2 + unknown2),
    )
