"""Single pictures that are lost or come shifted."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from schemas.settings.camera import CameraFaults

Picture = NDArray[np.uint8]


class PictureFaults:
    """Draws a fate for each picture, always as many numbers, so that one fault leaves the others where they were."""

    def __init__(self, faults: CameraFaults, random: np.random.Generator) -> None:
        self._faults = faults
        self._random = random
        self.dropped = 0
        self.shifted = 0

    def applied(self, picture: Picture) -> Picture | None:
        """The picture as it leaves the camera; None if it does not."""
        dropped, jumped, direction, size = self._random.random(4).tolist()
        faults = self._faults
        if dropped < faults.drop_fraction:
            self.dropped += 1
            return None
        if jumped >= faults.jump_fraction:
            return picture
        self.shifted += 1
        length_px = faults.jump_px * (0.5 + 0.5 * size)
        return shifted(picture, length_px * math.cos(math.tau * direction), length_px * math.sin(math.tau * direction))


def shifted(picture: Picture, right_px: float, down_px: float) -> Picture:
    """The picture moved in its frame; what comes in at the edge repeats the edge."""
    move = np.array(((1.0, 0.0, right_px), (0.0, 1.0, down_px)))
    height, width = picture.shape
    return np.asarray(cv2.warpAffine(picture, move, (width, height), borderMode=cv2.BORDER_REPLICATE), np.uint8)
