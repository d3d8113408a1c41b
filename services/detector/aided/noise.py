"""How noisy a picture is."""

import cv2
import numpy as np
from numpy.typing import NDArray

from services.detector.detector import GreyPicture

_BLOCK_PX = 32
_BANDS = 4
_PERCENTILE = 25.0
_GAIN = 6.0
"""Of the mask below: the root of the sum of its squares."""
_MASK: NDArray[np.float32] = np.outer((1.0, -2.0, 1.0), (1.0, -2.0, 1.0)).astype(np.float32)


def noise_level(picture: GreyPicture) -> float:
    """Standard deviation of the pixels' noise, grey levels.

    From what remains after taking out all that is linear along rows or columns (Immerkaer, "Fast noise variance estimation",
    1996), in the quieter blocks of some bands of the picture: texture would pass for noise in the others.
    """
    height, width = picture.shape
    rows, columns = height // _BLOCK_PX, width // _BLOCK_PX
    if rows < 1 or columns < 1:
        return 0.0
    bands = picture[: rows * _BLOCK_PX].reshape(rows, _BLOCK_PX, width)[:: max(rows // _BANDS, 1)]
    used = np.ascontiguousarray(bands.reshape(-1, width)[:, : columns * _BLOCK_PX])
    fine = np.asarray(cv2.filter2D(used, cv2.CV_32F, _MASK))
    blocks = cv2.resize(fine * fine, (columns, len(used) // _BLOCK_PX), interpolation=cv2.INTER_AREA)
    return float(np.sqrt(np.percentile(blocks, _PERCENTILE))) / _GAIN
