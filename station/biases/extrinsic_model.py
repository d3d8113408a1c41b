"""Where the pad's corners appear in the picture of a camera that is built otherwise than believed."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from alight.geometry.camera import PinholeCamera
from alight.geometry.frames import R_body_camera
from alight.geometry.rotation import R_x, R_y, R_z
from schemas.message import Quaternion, Vector3
from station.biases.sightings import Array, Sightings


@dataclass(frozen=True)
class Parameter:
    """One of the unknowns."""

    name: str
    """With its unit; those of `schemas.settings.geolocator.Extrinsic` have the same name there."""
    nominal: float
    prior_sigma: float
    """How far it may be from nominal, a priori; where the flights do not show it, this decides."""


PARAMETERS = (
    Parameter("mount_roll_deg", 0.0, 10.0),
    Parameter("mount_pitch_deg", 0.0, 10.0),
    Parameter("mount_yaw_deg", 0.0, 10.0),
    Parameter("forward_m", 0.0, 0.05),
    Parameter("right_m", 0.0, 0.05),
    Parameter("down_m", 0.0, 0.05),
    Parameter("focal_scale", 1.0, 0.005),
    Parameter("pad_scale", 1.0, 0.05),
    Parameter("pad_down_m", 0.0, 0.5),
    Parameter("image_latency_s", 0.0, 0.1),
    Parameter("pad_azimuth_deg", 0.0, 180.0),
    Parameter("pad_tilt_north_deg", 0.0, 1.0),
    Parameter("pad_tilt_east_deg", 0.0, 1.0),
)
"""`pad_down_m` is how much lower the pad lies than surveyed; it, the pad's azimuth and its tilt (turns about north and east) are no errors
of the camera."""

NAMES = tuple(parameter.name for parameter in PARAMETERS)


@dataclass(frozen=True)
class BelievedCamera:
    """The camera as the geolocator has it."""

    lens: PinholeCamera
    q_body_gimbal: Quaternion
    camera_in_body_m: Vector3


NO_TURN: Array = np.zeros(3)


def predicted_px(
    values: Array, sightings: Sightings, camera: BelievedCamera, attitude_error_rad: Array = NO_TURN
) -> Array:
    """Where the corners should be seen, (N, C, 2), distorted pixels; NaN behind the camera.

    Args:
        values: Of `PARAMETERS`, in their order and units.
        sightings: Whose frames.
        camera: As believed.
        attitude_error_rad: By how much the attitude is turned too far about north, east and down, (3,) or for each frame (N, 3): small.
    """
    roll, pitch, yaw, forward_m, right_m, down_m, focal, size, pad_down_m, latency_s, azimuth, *tilt = values
    at_s = sightings.captured_s - latency_s
    R_ned_body = _small_turn(-attitude_error_rad) @ rotation_matrices(sightings.attitude.at(at_s))
    R_mount = R_z(math.radians(yaw)) @ R_y(math.radians(pitch)) @ R_x(math.radians(roll))
    R_bc = R_mount @ R_body_camera(camera.q_body_gimbal)
    lever_m = np.add(camera.camera_in_body_m, (forward_m, right_m, down_m))
    s, c = math.sin(math.radians(azimuth)), math.cos(math.radians(azimuth))
    R_ned_pad = _small_turn(np.radians([*tilt, 0.0])) @ np.array([[-s, c, 0.0], [c, s, 0.0], [0.0, 0.0, -1.0]])
    pad_ned_m = np.array([0.0, 0.0, pad_down_m]) - sightings.position.at(at_s)
    corners_ned_m = pad_ned_m[:, None, :] + size * sightings.corners_m @ R_ned_pad.T
    # For row vectors, v @ R applies the transpose of R.
    corners_camera_m = (corners_ned_m @ R_ned_body - lever_m) @ R_bc
    lens = dataclasses.replace(camera.lens, fx_px=camera.lens.fx_px * focal, fy_px=camera.lens.fy_px * focal)
    return lens.project(corners_camera_m.reshape(-1, 3)).reshape(sightings.corners_px.shape)


def _small_turn(turn_rad: Array) -> Array:
    """Rotations by small vectors (..., 3), (..., 3, 3), to second order."""
    x, y, z = np.moveaxis(turn_rad, -1, 0)
    nothing = np.zeros_like(x)
    rows = ((nothing, -z, y), (z, nothing, -x), (-y, x, nothing))
    cross = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    return np.asarray(np.eye(3) + cross + 0.5 * cross @ cross, float)


def rotation_matrices(q: Array) -> Array:
    """Rotation matrices (N, 3, 3) of quaternions (N, 4), normalised here."""
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
