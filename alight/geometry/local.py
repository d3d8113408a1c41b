"""From one point on the earth to another in local north, east, down: exact, through ECEF (Eq. 2 and 12)."""

import numpy as np
from numpy.typing import NDArray

from alight.geometry.local_frame import LocalFrame
from alight.geometry.rotation import VectorLike
from schemas.message import GlobalPosition


def ned_between(origin: GlobalPosition, point: GlobalPosition) -> NDArray[np.float64]:
    """The vector from `origin` to `point` in the NED frame at `origin`, metres, (3,).

    Heights are ellipsoidal. The down component is along the vertical of `origin`: the earth's curvature (8 cm at 1 km) is in it.
    """
    return np.array(LocalFrame(origin).ned_of(point))


def moved_by_ned(origin: GlobalPosition, ned_m: VectorLike) -> GlobalPosition:
    """The point that lies `ned_m` (north, east, down, metres) from `origin`.

    The geoid separation of `origin` is carried along, which is right to a centimetre over a landing's distances.

    Raises:
        ValueError: If `ned_m` is not finite or leads out of the atmosphere or to the earth's centre
            (pydantic's ValidationError is a ValueError).
    """
    return LocalFrame(origin).point_at(float(ned_m[0]), float(ned_m[1]), float(ned_m[2]))
