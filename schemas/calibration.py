"""The camera model: a pinhole with radial and tangential distortion (Eq. 4-6)."""

from typing import Annotated

from pydantic import Field

from schemas.frame import MAX_SIDE_PX
from schemas.message import ShortText, Stamped


class CameraCalibration(Stamped):
    """Intrinsic parameters of the camera, valid for one resolution."""

    width_px: Annotated[int, Field(gt=0, le=MAX_SIDE_PX)]
    """Width of the pictures that these numbers belong to, pixels."""
    height_px: Annotated[int, Field(gt=0, le=MAX_SIDE_PX)]
    """Height of the pictures that these numbers belong to, pixels."""
    fx_px: Annotated[float, Field(gt=0.0)]
    """Focal length along image x, pixels."""
    fy_px: Annotated[float, Field(gt=0.0)]
    """Focal length along image y, pixels."""
    cx_px: float
    """Principal point, image x, pixels; the centre of the upper left pixel is (0, 0)."""
    cy_px: float
    """Principal point, image y, pixels."""
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """k1, k2, p1, p2, k3 of OpenCV's model, dimensionless."""
    row_time_s: Annotated[float, Field(ge=-1e-3, le=1e-3)] = 0.0
    """Rolling shutter: from the exposure of one row to that of the row below it, seconds; 0 if all rows are exposed at once, negative if
    the lowest row is first (a camera that is mounted upside down)."""
    source: ShortText = ""
    """Where the numbers come from, for people."""
