"""The pinhole camera with OpenCV's radial and tangential distortion (Eq. 4-6)."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from alight.geometry.rotation import Matrix
from schemas.calibration import CameraCalibration

Points = NDArray[np.float64]

_MAX_NEWTON_STEPS = 30
_CONVERGED = 1e-13
_RESIDUAL_LIMIT = 1e-9


@dataclass(frozen=True)
class PinholeCamera:
    """A camera model; camera frame x right, y down, z along the optical axis."""

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    @classmethod
    def from_calibration(cls, calibration: CameraCalibration) -> Self:
        """The model that a calibration message describes."""
        size = (calibration.width_px, calibration.height_px)
        focal = (calibration.fx_px, calibration.fy_px)
        return cls(*size, *focal, calibration.cx_px, calibration.cy_px, *calibration.distortion)

    @property
    def matrix(self) -> Matrix:
        """The intrinsic matrix A (Eq. 4), (3, 3), pixels."""
        return np.array([[self.fx_px, 0.0, self.cx_px], [0.0, self.fy_px, self.cy_px], [0.0, 0.0, 1.0]])

    @property
    def distortion(self) -> Points:
        """k1, k2, p1, p2, k3, (5,), dimensionless, as OpenCV wants them."""
        return np.array([self.k1, self.k2, self.p1, self.p2, self.k3])

    def project(self, points_camera_m: ArrayLike) -> Points:
        """Where points appear in the picture (Eq. 6).

        Args:
            points_camera_m: (N, 3), camera frame, metres.

        Returns:
            (N, 2), distorted pixels, inside the picture or not; NaN for points that are not in front of the camera.
        """
        x, y, z = np.asarray(points_camera_m, float).reshape(-1, 3).T
        depth = np.where(z > 0.0, z, np.nan)
        return self.pixels(np.column_stack((x / depth, y / depth)))

    def pixels(self, normalised: ArrayLike) -> Points:
        """Distorted pixels (N, 2) of rays given by their undistorted coordinates x/z, y/z, (N, 2)."""
        x, y = np.asarray(normalised, float).reshape(-1, 2).T
        xd, yd, _ = self._distorted(x, y)
        return np.column_stack((self.fx_px * xd + self.cx_px, self.fy_px * yd + self.cy_px))

    def undistorted(self, pixels: ArrayLike) -> Points:
        """The rays on which pixels lie: the inverse of `pixels`, by Newton's method.

        Args:
            pixels: (N, 2), distorted pixels.

        Returns:
            (N, 2), undistorted normalised coordinates x/z, y/z, exact to 1e-9; NaN where the model has no inverse.
        """
        u, v = np.asarray(pixels, float).reshape(-1, 2).T
        target_x, target_y = (u - self.cx_px) / self.fx_px, (v - self.cy_px) / self.fy_px
        x, y = target_x.copy(), target_y.copy()
        with np.errstate(all="ignore"):
            for _ in range(_MAX_NEWTON_STEPS):
                xd, yd, (d_xx, d_xy, d_yy) = self._distorted(x, y)
                error_x, error_y = xd - target_x, yd - target_y
                determinant = d_xx * d_yy - d_xy * d_xy
                step_x = (d_yy * error_x - d_xy * error_y) / determinant
                step_y = (d_xx * error_y - d_xy * error_x) / determinant
                x, y = x - step_x, y - step_y
                if np.max(np.abs(step_x) + np.abs(step_y), initial=0.0) < _CONVERGED:
                    break
            solved = self._is_solution(x, y, target_x, target_y)
        return np.where(solved[:, None], np.column_stack((x, y)), np.nan)

    def _is_solution(self, x: Points, y: Points, target_x: Points, target_y: Points) -> NDArray[np.bool_]:
        """Whether (x, y) is distorted to the target, on the side of the model where a lens does not mirror or fold."""
        xd, yd, (d_xx, d_xy, d_yy) = self._distorted(x, y)
        met = np.hypot(xd - target_x, yd - target_y) < _RESIDUAL_LIMIT
        unfolded = (d_xx * d_yy > d_xy * d_xy) & (d_xx + d_yy > 0.0)
        return np.asarray(met & unfolded)

    def _distorted(self, x: Points, y: Points) -> tuple[Points, Points, tuple[Points, Points, Points]]:
        """Distorted coordinates, and their symmetric Jacobian (d xd/dx, d xd/dy = d yd/dx, d yd/dy)."""
        r2 = x * x + y * y
        radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        slope = 2.0 * (self.k1 + r2 * (2.0 * self.k2 + 3.0 * r2 * self.k3))
        p1x, p1y, p2x, p2y = self.p1 * x, self.p1 * y, self.p2 * x, self.p2 * y
        xd = x * radial + 2.0 * p1x * y + self.p2 * (r2 + 2.0 * x * x)
        yd = y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * p2x * y
        d_xx = radial + slope * x * x + 2.0 * p1y + 6.0 * p2x
        d_xy = slope * x * y + 2.0 * p1x + 2.0 * p2y
        d_yy = radial + slope * y * y + 6.0 * p1y + 2.0 * p2x
        return xd, yd, (d_xx, d_xy, d_yy)
