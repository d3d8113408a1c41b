"""Rendered frames to learn from: markers of any family and number from 2 m to 55 m, and ground strewn with things that are none."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alight.markers.family import dictionary
from alight.runtime.seed import generator
from station.bench.detection_scene import Studio

Picture = NDArray[np.uint8]

FAMILIES = ("5x5_1000", "5x5_1000", "4x4_250", "6x6_250", "apriltag_36h11", "apriltag_25h9")
_STUDIO_PADS = 16
_LOWEST_M, _HIGHEST_M = 1.9, 55.0
_SHOTS_A_HEIGHT = 16
_CLUTTERED = 2
"""Every second height's shots have things lying around the pad."""
_FIRST_SEED = 20_000
"""Far from those of the benches."""


@dataclass(frozen=True)
class Frame:
    """A picture and the marker in it."""

    picture: Picture
    """(480, 640), grey levels."""
    centre_px: tuple[float, float]
    """Of the marker; NaN if there is none."""
    side_px: float
    """Mean length of its sides; NaN if there is none."""


def frames(seed: int, studio: int, shots: int, clutter: int) -> Iterator[Frame]:
    """Frames of sixteen cameras, each with a marker, ground, blur and noise of its own, every other one with a shadow's edge.

    Args:
        seed: Of everything random.
        studio: Which sixteen cameras.
        shots: How many frames with a marker.
        clutter: How many without.
    """
    draw = generator(seed, f"train_yolo.frames.{studio}")
    cameras = Studio(_FIRST_SEED + 1000 * seed + studio, pads=[_any_marker(draw) for _ in range(_STUDIO_PADS)])
    for number in range(shots // _SHOTS_A_HEIGHT):
        height_m = float(_LOWEST_M * (_HIGHEST_M / _LOWEST_M) ** draw.random())
        cluttered = number % _CLUTTERED == 1
        for shot in cameras.shots(height_m, _SHOTS_A_HEIGHT, clutter=cluttered, codes=False):
            x, y = shot.corners_px.mean(axis=0).tolist()
            sides = np.linalg.norm(shot.corners_px - np.roll(shot.corners_px, 1, axis=0), axis=1)
            yield Frame(shot.picture, (x, y), float(sides.mean()))
    for picture in cameras.clutter(clutter, codes=False):
        yield Frame(picture, (np.nan, np.nan), np.nan)


def _any_marker(draw: np.random.Generator) -> dict[str, object]:
    family = str(draw.choice(FAMILIES))
    return {"family": family, "id": int(draw.integers(len(dictionary(family).bytesList)))}
