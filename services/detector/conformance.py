"""What every detector must do, as checks that any package can run on its own: `for check in CHECKS: check(build)`.

The pictures are drawn here, with nothing but OpenCV, so that a package needs no camera service to test a detector.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from alight.geometry.rotation import quaternion_from_euler
from alight.markers.family import marker_cells
from schemas.settings import Settings
from services.detector.detector import Detector, FoundMarker, GreyPicture, Prior, View

Builder = Callable[[Settings], Detector]
Corners = NDArray[np.float64]

CAMERA = PinholeCamera(640, 480, 300.0, 300.0, 319.5, 239.5)
"""The camera of the pictures."""
FRAME_NS = 33_333_333

_FINER = 4
_GROUND, _INK, _PAPER = 120.0, 30.0, 220.0
_BLUR_PX = 0.7
_NOISE = 2.0
_NEAR_PX = 0.6
_CENTRED_PX = 0.12


class ConformanceError(AssertionError):
    """A detector does not do what all must do."""


@dataclass(frozen=True)
class DrawnPad:
    """A picture of the pad and where its corners are."""

    picture: GreyPicture
    corners_px: Corners


def drawn_pad(
    settings: Settings,
    *,
    side_px: float = 60.0,
    centre_px: tuple[float, float] = (320.0, 240.0),
    turn_rad: float = 0.0,
    seed: int = 0,
) -> DrawnPad:
    """The settings' pad, seen from straight above; the upper left pixel's centre is (0, 0).

    Args:
        settings: Their `pad` is a single marker.
        side_px: Length of its black outer edge, pixels.
        centre_px: Its centre.
        turn_rad: Turn of its print in the picture, from right towards down.
        seed: Of the noise.
    """
    cells = np.pad(marker_cells(settings.pad.family, settings.pad.id), 1, constant_values=1)
    shades = np.where(cells == 1, _PAPER, _INK).astype(np.float32)
    count, cell_px = cells.shape[0] - 2, side_px / (cells.shape[0] - 2)
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    # Places in the picture that is drawn finer; the middle of its upper left pixel is not that of the coarse one.
    turn = np.array([[c, -s], [s, c]]) * cell_px * _FINER
    middle = (np.array(centre_px) + 0.5) * _FINER - 0.5
    places = np.column_stack((turn, middle - turn @ np.full(2, count / 2.0 + 0.5)))
    fine = cv2.warpAffine(
        shades,
        places,
        (CAMERA.width_px * _FINER, CAMERA.height_px * _FINER),
        flags=cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(_GROUND,),
    )
    coarse = cv2.resize(fine, (CAMERA.width_px, CAMERA.height_px), interpolation=cv2.INTER_AREA)
    soft = cv2.GaussianBlur(coarse, (0, 0), _BLUR_PX)
    noisy = soft + np.random.default_rng(seed).normal(0.0, _NOISE, soft.shape)
    half = side_px / 2.0
    square = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    picture = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
    picture.setflags(write=False)
    return DrawnPad(picture, square @ np.array([[c, s], [-s, c]]) + np.array(centre_px))


def check_it_has_a_name_and_counters(build: Builder) -> None:
    """Its name and its counters fit messages."""
    detector = build(Settings())
    _require(bool(detector.name), "it has no name")
    _require(all(isinstance(value, int) for value in detector.counters().values()), "a counter is no whole number")


def check_it_finds_the_pad_whichever_way_it_is_turned(build: Builder) -> None:
    """Id, order of the corners, and their places."""
    for turn_rad in np.linspace(0.1, math.tau, 7):
        pad = drawn_pad(Settings(), turn_rad=float(turn_rad))
        found = _pad_of(build(Settings()).detect(View(pad.picture, 1, CAMERA)))
        error = np.abs(found.corners_px - pad.corners_px).max()
        _require(
            error < _NEAR_PX, f"turned by {turn_rad:.1f} rad, a corner is {error:.2f} px off, or the order is wrong"
        )


def check_the_upper_left_pixels_centre_is_the_origin(build: Builder) -> None:
    """Half a pixel too far, on average over many places, is the usual mistake."""
    shifts = []
    for number in range(12):
        centre = (300.0 + 3.17 * number, 200.0 + 5.29 * number)
        pad = drawn_pad(Settings(), side_px=48.0 + 1.3 * number, centre_px=centre, turn_rad=0.5 * number, seed=number)
        found = _pad_of(build(Settings()).detect(View(pad.picture, 1, CAMERA)))
        shifts.append((found.corners_px - pad.corners_px).mean(axis=0))
    right, down = np.mean(shifts, axis=0).tolist()
    _require(max(abs(right), abs(down)) < _CENTRED_PX, f"corners are shifted by {right:+.2f}, {down:+.2f} px")


def check_it_sees_nothing_where_nothing_is(build: Builder) -> None:
    """Black, white, noise, a slope and a plain square hold no pad."""
    noise = np.random.default_rng(3).integers(0, 255, (480, 640)).astype(np.uint8)
    slope = np.tile(np.linspace(0, 255, 640).astype(np.uint8), (480, 1))
    square = np.full((480, 640), 200, np.uint8)
    square[200:260, 300:360] = 20
    detector = build(Settings())
    for number, picture in enumerate((np.zeros_like(noise), np.full_like(noise, 255), noise, slope, square)):
        found = detector.detect(View(picture, number * FRAME_NS + 1, CAMERA))
        _require(not any(_is_pad(marker) for marker in found), f"it finds the pad in picture {number} without any")


def check_it_needs_neither_camera_nor_prior(build: Builder) -> None:
    """There are corners without a calibration, too."""
    pad = drawn_pad(Settings(), turn_rad=0.3)
    found = _pad_of(build(Settings()).detect(View(pad.picture, 1)))
    _require(
        float(np.abs(found.corners_px - pad.corners_px).max()) < _NEAR_PX, "without a camera, corners are elsewhere"
    )


def check_a_wrong_prior_loses_nothing(build: Builder) -> None:
    """Height, place and attitude may all be wrong."""
    pad = drawn_pad(Settings(), turn_rad=0.7)
    upside_down = quaternion_from_euler(3.0, 0.2, 0.1)
    priors = (
        Prior(height_m=90.0, height_sigma_m=0.5),
        Prior(height_m=0.3, height_sigma_m=0.01, centre_px=(20.0, 20.0), centre_sigma_px=2.0),
        Prior(q_ned_camera=upside_down, attitude_sigma_rad=0.01, height_m=5.0, height_sigma_m=0.1),
        Prior(centre_px=(-5e4, 9e5), centre_sigma_px=1.0, height_m=5.0, height_sigma_m=0.1),
    )
    for number, prior in enumerate(priors):
        _pad_of(build(Settings()).detect(View(pad.picture, 1, CAMERA, prior)), f"with wrong prior {number}")


def check_it_says_how_sure_it_is(build: Builder) -> None:
    """A standard deviation, and a covariance where it gives one."""
    pad = drawn_pad(Settings(), turn_rad=0.2)
    found = _pad_of(build(Settings()).detect(View(pad.picture, 1, CAMERA)))
    _require(0.0 < found.corner_sigma_px < 2.0, f"the corners' standard deviation is {found.corner_sigma_px}")
    covariance = found.corner_covariance_px2
    if covariance is not None:
        _require(covariance.shape == (8, 8), "the covariance is not (8, 8)")
        _require(float(np.linalg.eigvalsh(covariance).min()) > -1e-9, "the covariance is none")


def check_it_follows_and_finds_again(build: Builder) -> None:
    """Along a path, through a jump, and after the pad was gone."""
    detector = build(Settings())
    path = [(150.0 + 6.0 * step, 200.0 + 2.0 * step) for step in range(6)] + [(500.0, 380.0)] * 2
    for number, centre in enumerate(path, start=1):
        pad = drawn_pad(Settings(), centre_px=centre, turn_rad=0.4, seed=number)
        found = _pad_of(detector.detect(View(pad.picture, number * FRAME_NS, CAMERA)), f"in frame {number}")
        _require(
            float(np.abs(found.corners_px - pad.corners_px).max()) < _NEAR_PX, f"in frame {number} it is elsewhere"
        )
    blank = np.full((480, 640), 120, np.uint8)
    gone = detector.detect(View(blank, 20 * FRAME_NS, CAMERA))
    _require(not any(_is_pad(marker) for marker in gone), "it still sees the pad when it is gone")
    pad = drawn_pad(Settings())
    _pad_of(detector.detect(View(pad.picture, 21 * FRAME_NS, CAMERA)), "after it was gone")


def check_it_gives_the_same_again(build: Builder) -> None:
    """A recorded flight must come out alike."""
    pads = [drawn_pad(Settings(), centre_px=(300.0 + 4.0 * step, 240.0), seed=step) for step in range(4)]
    runs = []
    for _ in range(2):
        detector = build(Settings())
        views = [View(pad.picture, (number + 1) * FRAME_NS, CAMERA) for number, pad in enumerate(pads)]
        runs.append([_pad_of(detector.detect(view)).corners_px for view in views])
    _require(bool(np.array_equal(runs[0], runs[1])), "the same frames give other corners the second time")


CHECKS: tuple[Callable[[Builder], None], ...] = (
    check_it_has_a_name_and_counters,
    check_it_finds_the_pad_whichever_way_it_is_turned,
    check_the_upper_left_pixels_centre_is_the_origin,
    check_it_sees_nothing_where_nothing_is,
    check_it_needs_neither_camera_nor_prior,
    check_a_wrong_prior_loses_nothing,
    check_it_says_how_sure_it_is,
    check_it_follows_and_finds_again,
    check_it_gives_the_same_again,
)
"""All of them."""


def _is_pad(marker: FoundMarker) -> bool:
    pad = Settings().pad
    return (marker.family, marker.id) == (pad.family, pad.id)


def _pad_of(found: tuple[FoundMarker, ...], where: str = "in a clear picture") -> FoundMarker:
    for marker in found:
        if _is_pad(marker):
            return marker
    raise ConformanceError(f"it does not find the pad {where}")


def _require(good: bool, complaint: str) -> None:
    if not good:
        raise ConformanceError(complaint)
