"""The paper's calibration flight (Section 4.1): an upward spiral over a chessboard of 9 x 6 inner corners and 20 cm squares.

The paper gives neither radius nor where the camera looked. A camera that looked straight down all the way would see the board
untilted in every picture, which leaves the focal length open. Here the gimbal leads the board through every part of the picture.
"""

import math
from collections.abc import Iterator

import numpy as np

from alight.geometry.camera import PinholeCamera
from alight.geometry.frames import R_body_camera
from alight.geometry.rotation import (
    R_from_quaternion,
    quaternion_from_R,
    quaternion_from_rotation_vector,
)
from alight.runtime.clock import NS_PER_S
from schemas.message import GlobalPosition
from schemas.settings import Settings
from schemas.truth import GroundTruth
from services.camera.calibration_file import configured_calibration
from services.camera.chess_print import ChessPrint
from services.camera.simulated_camera import SimulatedCamera
from station.calibrate.board import Chessboard, Grey

BOARD = Chessboard(columns=9, rows=6, square_m=0.2)
PICTURES = 80
TURNS = 5.0
LOWEST_M, HIGHEST_M = 1.8, 4.5
"""Of the camera above the board."""
RADIUS = 0.6
"""Of the spiral, as a part of the height."""
SPEED_MPS = 0.5

_SPARE_PX = 14.0
_SOMEWHERE = GlobalPosition(latitude_deg=47.4, longitude_deg=8.5, altitude_amsl_m=500.0, ellipsoidal_height_m=500.0)


def spiral_pictures(settings: Settings, count: int = PICTURES) -> Iterator[tuple[str, Grey]]:
    """Pictures from the flight, as the simulated camera takes them: blurred, smeared and noisy.

    Args:
        settings: Camera, installation and seed.
        count: How many; fewer are spread over the same flight.
    """
    calibration = configured_calibration(settings.camera)
    chessboard = ChessPrint(BOARD.columns, BOARD.rows, BOARD.square_m, settings.camera.simulated.board)
    simulated = SimulatedCamera(settings, calibration, chessboard)
    lens = PinholeCamera.from_calibration(calibration)
    for number in range(count):
        yield f"spiral_{number:03d}", simulated.capture(_truth(number, number / max(count - 1, 1), lens))


def _truth(number: int, along: float, lens: PinholeCamera) -> GroundTruth:
    """Vehicle and camera after a part of the flight, 0 to 1; the camera's attitude stands for the vehicle's, on which it is fixed here."""
    height_m = LOWEST_M + (HIGHEST_M - LOWEST_M) * along
    azimuth_rad = math.tau * TURNS * along
    place_m = np.array(
        (RADIUS * height_m * math.cos(azimuth_rad), RADIUS * height_m * math.sin(azimuth_rad), -height_m)
    )
    north_mps, east_mps = -SPEED_MPS * math.sin(azimuth_rad), SPEED_MPS * math.cos(azimuth_rad)
    north_m, east_m, down_m = place_m.tolist()
    return GroundTruth(
        at_ns=NS_PER_S + number * NS_PER_S // 5,
        vehicle_position=_SOMEWHERE,
        velocity_ned_mps=(north_mps, east_mps, 0.0),
        q_ned_body=quaternion_from_R(_looking(place_m, _target_px(number, float(np.linalg.norm(place_m)), lens), lens)),
        angular_velocity_body_rps=(0.0, 0.0, 0.0),
        pad_position=_SOMEWHERE,
        pad_azimuth_rad=0.0,
        vehicle_from_pad_ned_m=(north_m, east_m, down_m),
        touching_ground=False,
    )


def _target_px(number: int, distance_m: float, lens: PinholeCamera) -> tuple[float, float]:
    """Where in the picture the board's middle shall be: evenly spread (Halton), and never so that the board is cut off."""
    size_px = (lens.width_px, lens.height_px)
    sides_m = ((BOARD.columns + 1) * BOARD.square_m, (BOARD.rows + 1) * BOARD.square_m)
    spread = (_halton(number + 1, 2), _halton(number + 1, 3))
    x, y = (
        size / 2.0 + (2.0 * share - 1.0) * max(size / 2.0 - _SPARE_PX - 0.5 * lens.fx_px * side_m / distance_m, 0.0)
        for size, side_m, share in zip(size_px, sides_m, spread, strict=True)
    )
    return x, y


def _looking(
    place_m: np.ndarray[tuple[int, ...], np.dtype[np.float64]], target_px: tuple[float, float], lens: PinholeCamera
) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """R_ned_body that puts the board's middle on a pixel: the shortest turn from level with the nose to the north."""
    x, y = lens.undistorted([target_px])[0].tolist()
    ray = R_body_camera() @ np.array((x, y, 1.0))
    ray /= np.linalg.norm(ray)
    towards = -place_m / np.linalg.norm(place_m)
    axis, cosine = np.cross(ray, towards), float(ray @ towards)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        return np.eye(3)
    vector = (axis / sine * math.atan2(sine, cosine)).tolist()
    return R_from_quaternion(quaternion_from_rotation_vector((vector[0], vector[1], vector[2])))


def _halton(index: int, base: int) -> float:
    share, part = 0.0, 1.0
    while index:
        part /= base
        index, digit = divmod(index, base)
        share += digit * part
    return share
