"""Squares cut from frames at the scales at which the network looks at them, kept in a file so that they are rendered once."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.runtime.seed import generator
from station.train_yolo.frames import Frame, frames

LEVELS = 4
"""The whole picture, and made smaller by 2, 4 and 8."""
CROP_PX = 96
BEYOND = 112
"""What is beyond the picture's edge, grey levels: about zero after the network's logarithm, which is what its layers add there."""

_LEAST_SIDE_PX, _LARGEST_SIDE_PX = 3.0, 40.0
_MARGIN_PX = 6
_CLUTTER_CROPS = 3


@dataclass(frozen=True)
class Crops:
    """What the network learns from."""

    pictures: NDArray[np.uint8]
    """(N, CROP_PX, CROP_PX), grey levels."""
    markers: NDArray[np.float32]
    """(N, 3): x and y of the marker's centre and its side, pixels of the crop; NaN if there is none in it."""


def cached_crops(seed: int, studios: int, shots: int, clutter: int, folder: Path) -> Crops:
    """Those of so many studios; each is rendered only if the folder does not hold it yet."""
    folder.mkdir(parents=True, exist_ok=True)
    parts = []
    for studio in range(studios):
        file = folder / f"crops-{seed}-{studio}-{shots}-{clutter}.npz"
        if not file.exists():
            made = crops_of(seed, studio, shots, clutter)
            temporary = file.with_suffix(".part.npz")
            np.savez_compressed(temporary, pictures=made.pictures, markers=made.markers)
            temporary.rename(file)
        with np.load(file) as held:
            parts.append(Crops(held["pictures"], held["markers"]))
        print(f"{file.name}: {len(parts[-1].pictures)} crops", flush=True)
    return Crops(np.concatenate([part.pictures for part in parts]), np.concatenate([part.markers for part in parts]))


def crops_of(seed: int, studio: int, shots: int, clutter: int) -> Crops:
    """Those of one studio: from each frame, at each scale, one with the marker where it is neither tiny nor huge, and others from anywhere."""
    draw = generator(seed, f"train_yolo.crops.{studio}")
    cut = [crop for frame in frames(seed, studio, shots, clutter) for crop in crops_from(frame, draw)]
    return Crops(np.array([picture for picture, _ in cut]), np.array([marker for _, marker in cut], np.float32))


def crops_from(frame: Frame, draw: np.random.Generator) -> Iterator[tuple[NDArray[np.uint8], NDArray[np.float64]]]:
    """Pictures and markers, as in `Crops`, from one frame."""
    for level in range(LEVELS):
        shrink = 1 << level
        size = (frame.picture.shape[1] // shrink, frame.picture.shape[0] // shrink)
        small = np.asarray(cv2.resize(frame.picture, size, interpolation=cv2.INTER_AREA), np.uint8)
        marker = _in_level(frame, shrink)
        corners = [_anywhere(small, draw) for _ in range(1 if np.isfinite(marker[2]) else _CLUTTER_CROPS)]
        if _LEAST_SIDE_PX < marker[2] < _LARGEST_SIDE_PX:
            corners.append(_around(marker, draw))
        for left, top in corners:
            yield _cut(small, left, top), _within(marker - (left, top, 0.0))


def _in_level(frame: Frame, shrink: int) -> NDArray[np.float64]:
    x, y = frame.centre_px
    return np.array(((x + 0.5) / shrink - 0.5, (y + 0.5) / shrink - 0.5, frame.side_px / shrink))


def _anywhere(picture: NDArray[np.uint8], draw: np.random.Generator) -> tuple[int, int]:
    height, width = picture.shape
    x, y = (int(draw.integers(min(0, size - CROP_PX), max(0, size - CROP_PX) + 1)) for size in (width, height))
    return x, y


def _around(marker: NDArray[np.float64], draw: np.random.Generator) -> tuple[int, int]:
    x, y = (int(value - draw.uniform(_MARGIN_PX, CROP_PX - _MARGIN_PX)) for value in marker[:2].tolist())
    return x, y


def _cut(picture: NDArray[np.uint8], left: int, top: int) -> NDArray[np.uint8]:
    height, width = picture.shape
    crop = np.full((CROP_PX, CROP_PX), BEYOND, np.uint8)
    x0, y0, x1, y1 = max(left, 0), max(top, 0), min(left + CROP_PX, width), min(top + CROP_PX, height)
    if x0 < x1 and y0 < y1:
        crop[y0 - top : y1 - top, x0 - left : x1 - left] = picture[y0:y1, x0:x1]
    return crop


def _within(marker: NDArray[np.float64]) -> NDArray[np.float64]:
    inside = np.isfinite(marker).all() and (marker[:2] > -0.5).all() and (marker[:2] < CROP_PX - 0.5).all()
    return marker if inside else np.full(3, np.nan)
