"""Averages of directions: on a circle, where there is no smallest and no largest."""

import math
from collections.abc import Sequence

from alight.geometry.rotation import wrap_pi

_NO_DIRECTION = 1e-9
_TIE = 1e-9


def circular_mean(angles_rad: Sequence[float]) -> float:
    """The direction of the sum of unit vectors, rad in (-pi, pi].

    Where they cancel out and there is no such direction, the last angle.

    Raises:
        ValueError: If there are no angles.
    """
    if not angles_rad:
        raise ValueError("the mean of no angles")
    sine, cosine = math.fsum(map(math.sin, angles_rad)), math.fsum(map(math.cos, angles_rad))
    if math.hypot(sine, cosine) < _NO_DIRECTION * len(angles_rad):
        return wrap_pi(angles_rad[-1])
    return wrap_pi(math.atan2(sine, cosine))


def circular_median(angles_rad: Sequence[float]) -> float:
    """The direction with the smallest sum of arc lengths to all angles, rad in (-pi, pi].

    The sum is piecewise linear with its minima at the angles themselves. Where several angles share the smallest sum (as
    the two middle ones of an even number do), the median is the circular mean of these. On an arc shorter than half a
    circle this is the ordinary median.

    Raises:
        ValueError: If there are no angles.
    """
    if not angles_rad:
        raise ValueError("the median of no angles")
    sums = [math.fsum(abs(math.remainder(other - angle, math.tau)) for other in angles_rad) for angle in angles_rad]
    least = min(sums) + _TIE
    return circular_mean([angle for angle, total in zip(angles_rad, sums, strict=True) if total <= least])
