"""What every detector must do, as checks that any package can run on its own: `for check in CHECKS: check(build)`.

A detector that reads no markers of the paper's pad is shown another: `check(build, Settings.model_validate({"pad": ...}))`.
The pictures are drawn here, with nothing but OpenCV, so that a package needs no camera service to test a detector.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from alight.geometry.rotation import quaternion_from_euler
from alight.markers.layout import PadLayout, layout_from
from alight.markers.print_grid import print_grid
from schemas.settings import Settings
from services.detector.detector import Detector, FoundMarker, GreyPicture, Prior, View

Builder = Callable[[Settings], Detector]
Corners = NDArray[np.float64]

CAMERA = PinholeCamera(640, 480, 300.0, 300.0, 319.5, 239.5)
"""The camera of the pictures."""
FRAME_NS = 33_333_333

_PAPERS = Settings()
"""The paper's pad."""
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
    """A picture of the pad and where its markers are."""

    picture: GreyPicture
    layout: PadLayout
    px_per_m: float
    centre_px: tuple[float, float]
    turn_rad: float

    @property
    def corners_px(self) -> Corners:
        """The corners of its largest marker, (4, 2)."""
        return self.pixels(self.layout.markers[0].corners_m())

    def pixels(self, points_m: Corners) -> Corners:
        """Where points of the pad are in the picture, (N, 2)."""
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        down = points_m[:, :2] * (self.px_per_m, -self.px_per_m)
        return np.asarray(down @ np.array([[c, s], [-s, c]]) + np.array(self.centre_px))

    def errors_px(self, found: tuple[FoundMarker, ...], where: str = "in a clear picture") -> Corners:
        """How far the corners of the pad's markers are from where they should be, (n, 4, 2).

        Raises:
            ConformanceError: If none was found.
        """
        known = [(marker, self.layout.find(marker.family, marker.id)) for marker in found]
        errors = [marker.corners_px - self.pixels(placed.corners_m()) for marker, placed in known if placed]
        _require(bool(errors), f"it does not find the pad {where}")
        return np.array(errors)


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
        settings: Their `pad` has no marker that lies askew.
        side_px: Length of its largest marker's black outer edge, pixels.
        centre_px: Its centre.
        turn_rad: Turn of its print in the picture, from right towards down.
        seed: Of the noise.
    """
    layout = layout_from(settings.pad)
    px_per_m = side_px / layout.markers[0].side_m
    fine = _print_from_above(layout, px_per_m, centre_px, turn_rad)
    coarse = cv2.resize(fine, (CAMERA.width_px, CAMERA.height_px), interpolation=cv2.INTER_AREA)
    soft = cv2.GaussianBlur(coarse, (0, 0), _BLUR_PX)
    noisy = soft + np.random.default_rng(seed).normal(0.0, _NOISE, soft.shape)
    picture = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
    picture.setflags(write=False)
    return DrawnPad(picture, layout, px_per_m, centre_px, turn_rad)


def _print_from_above(
    layout: PadLayout, px_per_m: float, centre_px: tuple[float, float], turn_rad: float
) -> NDArray[np.float32]:
    """Print and ground in a picture that is so much finer."""
    width, height = CAMERA.width_px * _FINER, CAMERA.height_px * _FINER
    picture = np.full((height, width), _GROUND, np.float32)
    # Places in the finer picture: the middle of its upper left pixel is not that of the coarse one.
    middle_x, middle_y = ((value + 0.5) * _FINER - 0.5 for value in centre_px)
    reach = math.ceil(layout.board_m * px_per_m * _FINER * math.sqrt(0.5))
    left, right = max(round(middle_x) - reach, 0), min(round(middle_x) + reach + 1, width)
    top, bottom = max(round(middle_y) - reach, 0), min(round(middle_y) + reach + 1, height)
    across = (np.arange(left, right) - middle_x)[None, :] / (px_per_m * _FINER)
    along = (np.arange(top, bottom) - middle_y)[:, None] / (px_per_m * _FINER)
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    grid = print_grid(layout.markers, layout.board_m, layout.ink)
    column = np.searchsorted(grid.x_m, c * across + s * along + layout.board_m / 2.0, side="right") - 1
    row = np.searchsorted(grid.y_m, c * along - s * across + layout.board_m / 2.0, side="right") - 1
    rows, columns = grid.white.shape
    on = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    white = grid.white[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)]
    picture[top:bottom, left:right] = np.where(on, np.where(white == 1, _PAPER, _INK), _GROUND)
    return picture


class Check(Protocol):
    """One thing that every detector must do."""

    __name__: str

    def __call__(self, build: Builder, settings: Settings = ..., /) -> None:
        """Check it on the settings' pad.

        Raises:
            ConformanceError: If the detector does not do it.
        """
        ...


def check_it_has_a_name_and_counters(build: Builder, settings: Settings = _PAPERS) -> None:
    """Its name and its counters fit messages."""
    detector = build(settings)
    _require(bool(detector.name), "it has no name")
    _require(all(isinstance(value, int) for value in detector.counters().values()), "a counter is no whole number")


def check_it_finds_the_pad_whichever_way_it_is_turned(build: Builder, settings: Settings = _PAPERS) -> None:
    """Id, order of the corners, and their places."""
    for turn_rad in np.linspace(0.1, math.tau, 7):
        pad = drawn_pad(settings, turn_rad=float(turn_rad))
        error = np.abs(pad.errors_px(build(settings).detect(View(pad.picture, 1, CAMERA)))).max()
        _require(
            error < _NEAR_PX, f"turned by {turn_rad:.1f} rad, a corner is {error:.2f} px off, or the order is wrong"
        )


def check_the_upper_left_pixels_centre_is_the_origin(build: Builder, settings: Settings = _PAPERS) -> None:
    """Half a pixel too far, on average over many places, is the usual mistake."""
    shifts = []
    for number in range(12):
        centre = (300.0 + 3.17 * number, 200.0 + 5.29 * number)
        pad = drawn_pad(settings, side_px=48.0 + 1.3 * number, centre_px=centre, turn_rad=0.5 * number, seed=number)
        found = build(settings).detect(View(pad.picture, 1, CAMERA))
        shifts.append(pad.errors_px(found).mean(axis=(0, 1)))
    right, down = np.mean(shifts, axis=0).tolist()
    _require(max(abs(right), abs(down)) < _CENTRED_PX, f"corners are shifted by {right:+.2f}, {down:+.2f} px")


def check_it_sees_nothing_where_nothing_is(build: Builder, settings: Settings = _PAPERS) -> None:
    """Black, white, noise, a slope and a plain square hold no pad."""
    noise = np.random.default_rng(3).integers(0, 255, (480, 640)).astype(np.uint8)
    slope = np.tile(np.linspace(0, 255, 640).astype(np.uint8), (480, 1))
    square = np.full((480, 640), 200, np.uint8)
    square[200:260, 300:360] = 20
    detector = build(settings)
    for number, picture in enumerate((np.zeros_like(noise), np.full_like(noise, 255), noise, slope, square)):
        found = detector.detect(View(picture, number * FRAME_NS + 1, CAMERA))
        _require(not _pads_own(found, settings), f"it finds the pad in picture {number} without any")


def check_it_needs_neither_camera_nor_prior(build: Builder, settings: Settings = _PAPERS) -> None:
    """There are corners without a calibration, too."""
    pad = drawn_pad(settings, turn_rad=0.3)
    error = np.abs(pad.errors_px(build(settings).detect(View(pad.picture, 1)))).max()
    _require(float(error) < _NEAR_PX, "without a camera, corners are elsewhere")


def check_a_wrong_prior_loses_nothing(build: Builder, settings: Settings = _PAPERS) -> None:
    """Height, place and attitude may all be wrong."""
    pad = drawn_pad(settings, turn_rad=0.7)
    upside_down = quaternion_from_euler(3.0, 0.2, 0.1)
    priors = (
        Prior(height_m=90.0, height_sigma_m=0.5),
        Prior(height_m=0.3, height_sigma_m=0.01, centre_px=(20.0, 20.0), centre_sigma_px=2.0),
        Prior(q_ned_camera=upside_down, attitude_sigma_rad=0.01, height_m=5.0, height_sigma_m=0.1),
        Prior(centre_px=(-5e4, 9e5), centre_sigma_px=1.0, height_m=5.0, height_sigma_m=0.1),
    )
    for number, prior in enumerate(priors):
        pad.errors_px(build(settings).detect(View(pad.picture, 1, CAMERA, prior)), f"with wrong prior {number}")


def check_it_says_how_sure_it_is(build: Builder, settings: Settings = _PAPERS) -> None:
    """A standard deviation, and a covariance where it gives one."""
    pad = drawn_pad(settings, turn_rad=0.2)
    own = _pads_own(build(settings).detect(View(pad.picture, 1, CAMERA)), settings)
    _require(bool(own), "it does not find the pad in a clear picture")
    for found in own:
        _require(0.0 < found.corner_sigma_px < 2.0, f"the corners' standard deviation is {found.corner_sigma_px}")
        covariance = found.corner_covariance_px2
        if covariance is not None:
            _require(covariance.shape == (8, 8), "the covariance is not (8, 8)")
            _require(float(np.linalg.eigvalsh(covariance).min()) > -1e-9, "the covariance is none")


def check_it_follows_and_finds_again(build: Builder, settings: Settings = _PAPERS) -> None:
    """Along a path, through a jump, and after the pad was gone."""
    detector = build(settings)
    path = [(150.0 + 6.0 * step, 200.0 + 2.0 * step) for step in range(6)] + [(500.0, 380.0)] * 2
    for number, centre in enumerate(path, start=1):
        pad = drawn_pad(settings, centre_px=centre, turn_rad=0.4, seed=number)
        error = pad.errors_px(detector.detect(View(pad.picture, number * FRAME_NS, CAMERA)), f"in frame {number}")
        _require(float(np.abs(error).max()) < _NEAR_PX, f"in frame {number} it is elsewhere")
    blank = np.full((480, 640), 120, np.uint8)
    gone = detector.detect(View(blank, 20 * FRAME_NS, CAMERA))
    _require(not _pads_own(gone, settings), "it still sees the pad when it is gone")
    pad = drawn_pad(settings)
    pad.errors_px(detector.detect(View(pad.picture, 21 * FRAME_NS, CAMERA)), "after it was gone")


def check_it_gives_the_same_again(build: Builder, settings: Settings = _PAPERS) -> None:
    """A recorded flight must come out alike."""
    pads = [drawn_pad(settings, centre_px=(300.0 + 4.0 * step, 240.0), seed=step) for step in range(4)]
    runs = []
    for _ in range(2):
        detector = build(settings)
        views = [View(pad.picture, (number + 1) * FRAME_NS, CAMERA) for number, pad in enumerate(pads)]
        runs.append([pad.errors_px(detector.detect(view)) for pad, view in zip(pads, views, strict=True)])
    same = all(np.array_equal(first, second) for first, second in zip(*runs, strict=True))
    _require(same, "the same frames give other corners the second time")


CHECKS: tuple[Check, ...] = (
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


def _pads_own(found: tuple[FoundMarker, ...], settings: Settings) -> tuple[FoundMarker, ...]:
    layout = layout_from(settings.pad)
    return tuple(marker for marker in found if layout.find(marker.family, marker.id))


def _require(good: bool, complaint: str) -> None:
    if not good:
        raise ConformanceError(complaint)
