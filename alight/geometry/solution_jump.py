"""A navigation solution that jumps: the position changes by more than the velocity explains.

PX4's estimator resets its position now and then. The vehicle has not moved by it, but every coordinate means another place from then on.
"""

import math

from schemas.message import Vector3
from schemas.vehicle import VehicleState

_LONGEST_STEP_S = 0.5
"""Over a longer silence nobody knows how far the vehicle flew."""


def solution_jump_ned_m(
    before: VehicleState, after: VehicleState, moved_ned_m: Vector3, least_m: float
) -> Vector3 | None:
    """What the mean velocity of two consecutive states leaves unexplained of the movement between them.

    Args:
        before: The earlier state.
        after: The later one.
        moved_ned_m: From the position of the one to that of the other: north, east, down, metres.
        least_m: Less than this is no jump, metres.

    Returns:
        The jump: north, east, down, metres. None if there is none, or if the states are too far apart in time to tell, or in wrong order.
    """
    step_s = (after.at_ns - before.at_ns) / 1e9
    if not 0.0 < step_s <= _LONGEST_STEP_S:
        return None
    half_s = 0.5 * step_s
    (n, e, d), (vn0, ve0, vd0), (vn, ve, vd) = moved_ned_m, before.velocity_ned_mps, after.velocity_ned_mps
    jump = (n - (vn0 + vn) * half_s, e - (ve0 + ve) * half_s, d - (vd0 + vd) * half_s)
    return None if math.hypot(*jump) < least_m else jump
