"""Choosing the pictures to calibrate with: sharp, and each from another place."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from station.calibrate.board import CalibrationBoard, FoundCorners, Grey

Array = NDArray[np.float64]

MOST_VIEWS = 60
"""More say nothing new and take long to solve."""
ALIKE = 0.06
"""Distance between descriptions (see `View.description`) below which two views are taken for one."""
BLURRED = 2.0
"""A view this many times as blurred as the sharper half is left out."""

_SHARP_ENOUGH_PX = 1.0


@dataclass(frozen=True)
class View:
    """One picture with the board in it."""

    name: str
    corners: FoundCorners
    blur_px: float
    """Standard deviation of the blur of the board's edges, pixels."""
    description: Array
    """Where the corners' middle is, how long the outline's diagonals and how they lie: all as parts of the picture's diagonal."""


@dataclass(frozen=True)
class Chosen:
    """The views to use, and what became of the others."""

    used: tuple[View, ...]
    blurred: tuple[View, ...]
    alike: tuple[View, ...]


def find_views(board: CalibrationBoard, pictures: Iterable[tuple[str, Grey]]) -> Iterator[tuple[str, View | None]]:
    """Look for the board; gives the name of every picture, and None where it is not."""
    for name, picture in pictures:
        corners = board.find(picture)
        yield name, None if corners is None else _view(name, picture, corners)


def choose_views(views: Sequence[View]) -> Chosen:
    """Leave out the blurred; of the others take the sharpest, then always the one that is least like those taken."""
    if not views:
        return Chosen((), (), ())
    typical_px = float(np.quantile([view.blur_px for view in views], 0.25))
    limit_px = max(BLURRED * typical_px, _SHARP_ENOUGH_PX)
    sharp = sorted((view for view in views if view.blur_px <= limit_px), key=lambda view: view.blur_px)
    used = [sharp[0]]
    descriptions = np.array([view.description for view in sharp])
    nearest = np.linalg.norm(descriptions - descriptions[0], axis=1)
    while len(used) < MOST_VIEWS and float(nearest.max()) > ALIKE:
        newest = int(np.argmax(nearest))
        used.append(sharp[newest])
        nearest = np.minimum(nearest, np.linalg.norm(descriptions - descriptions[newest], axis=1))
    taken = {id(view) for view in used}
    return Chosen(
        used=tuple(used),
        blurred=tuple(view for view in views if view.blur_px > limit_px),
        alike=tuple(view for view in sharp if id(view) not in taken),
    )


def _view(name: str, picture: Grey, corners: FoundCorners) -> View:
    # The outline's corners as a plane through all found ones puts them: boards that are partly in view compare as well.
    low, high = corners.points_m[:, :2].min(axis=0), corners.points_m[:, :2].max(axis=0)
    outline = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    homography, _ = cv2.findHomography(corners.points_m[:, :2], corners.pixels)
    quad = cv2.perspectiveTransform(outline.reshape(-1, 1, 2), homography).reshape(4, 2)
    diagonal_px = math.hypot(*picture.shape)
    middle = corners.pixels.mean(axis=0)
    description = np.concatenate(
        (middle, 0.5 * (quad[2] - quad[0]), 0.5 * (quad[3] - quad[1]), quad.sum(axis=0) / 2.0 - 2.0 * middle)
    )
    return View(name, corners, _blur_px(picture, corners.pixels), description / diagonal_px)


def _blur_px(picture: Grey, pixels: Array) -> float:
    """From the steepest edges within the board: an edge blurred by s has the slope contrast / (s sqrt(2 pi))."""
    hull = cv2.convexHull(np.rint(pixels).astype(np.int32))
    left, top, width, height = cv2.boundingRect(hull)
    left, top = max(left, 0), max(top, 0)
    part = picture[top : top + height, left : left + width].astype(np.float32)
    inside = np.zeros(part.shape, np.uint8)
    cv2.fillConvexPoly(inside, hull - (left, top), 1)
    slope = np.hypot(cv2.Sobel(part, cv2.CV_32F, 1, 0), cv2.Sobel(part, cv2.CV_32F, 0, 1)) / 8.0
    levels, slopes = part[inside > 0], slope[inside > 0]
    if len(levels) < 50:
        return math.inf
    contrast = float(np.quantile(levels, 0.95) - np.quantile(levels, 0.05))
    steepest = float(np.quantile(slopes, 0.98))
    return contrast / (max(steepest, 1e-3) * math.sqrt(math.tau))
