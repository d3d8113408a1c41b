"""A second look at what was read: whether the picture shows the marker's cells, or something that only reads like it."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.markers.family import cells_of

LEAST_AGREEMENT = 0.75
"""Correlation of picture and pattern below which a marker of a dense family is refused. It separates what was measured: all 4 look-alikes
that 5x5_1000 had in some 950 real pictures without it lie below (0.74 at most), 1 of 3145 true markers in a real video does, and a rendered
pad 26 m away has 0.84."""

_DENSE_CHANCE = 1e-3
_CORRECTION_RATE = 0.6
_SAMPLES_A_CELL = 3


def is_dense(dictionary: cv2.aruco.Dictionary) -> bool:
    """Whether chance reads a marker from random cells in more than one of a thousand quadrilaterals."""
    bits = dictionary.markerSize**2
    corrected = int(dictionary.maxCorrectionBits * _CORRECTION_RATE)
    readings = sum(math.comb(bits, errors) for errors in range(corrected + 1))
    return bool(4 * dictionary.bytesList.shape[0] * readings / 2.0**bits > _DENSE_CHANCE)


class PatternCheck:
    """Compares a marker's picture with its pattern."""

    def __init__(self, dictionary: cv2.aruco.Dictionary) -> None:
        self._dictionary = dictionary
        side = dictionary.markerSize + 2
        along = (np.arange(side * _SAMPLES_A_CELL) + 0.5) / (side * _SAMPLES_A_CELL)
        self._places = np.stack(np.meshgrid(along, along), axis=-1).reshape(-1, 1, 2).astype(np.float32)
        self._blocks = (side, _SAMPLES_A_CELL, side, _SAMPLES_A_CELL)
        self._patterns: dict[int, NDArray[np.float64]] = {}

    def agrees(self, picture: NDArray[np.uint8], corners_px: NDArray[np.float64], number: int) -> bool:
        """Whether the cells, as seen between the corners, correlate with the marker's."""
        return self.agreement(picture, corners_px, number) >= LEAST_AGREEMENT

    def agreement(self, picture: NDArray[np.uint8], corners_px: NDArray[np.float64], number: int) -> float:
        """Normalised correlation of the cells' mean brightness with the pattern, -1 to 1, whatever the light."""
        square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
        homography = cv2.getPerspectiveTransform(square, corners_px.astype(np.float32))
        where = np.asarray(cv2.perspectiveTransform(self._places, homography), np.float32)
        seen = cv2.remap(picture, where, np.empty(0, np.float32), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        cells = np.asarray(seen, float).reshape(self._blocks).mean(axis=(1, 3))
        cells -= cells.mean()
        pattern = self._pattern(number)
        return float((cells * pattern).sum() / max(float(np.linalg.norm(cells) * np.linalg.norm(pattern)), 1e-9))

    def _pattern(self, number: int) -> NDArray[np.float64]:
        if number not in self._patterns:
            cells = cells_of(self._dictionary, number, "of the detector").astype(float)
            self._patterns[number] = cells - cells.mean()
        return self._patterns[number]
