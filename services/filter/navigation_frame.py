"""The vehicle's navigation solution as a local frame that neither jumps nor leads too far from its origin."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from alight.geometry.local_frame import LocalFrame
from alight.runtime.clock import seconds
from schemas.message import GlobalPosition
from schemas.settings.filter import Kalman
from schemas.vehicle import VehicleState

Array = NDArray[np.float64]

_MOST_JUMPS = 16
_LONGEST_STEP_S = 0.5
"""Over a longer silence nobody knows how far the vehicle flew."""


class NavigationFrame:
    """Anchored at the first fix. Between two vehicle states the position changes by what the velocity explains, or the solution jumped.

    PX4's estimator resets its position now and then; the commander's setpoints and all coordinates then mean another place.
    Continuous coordinates = coordinates in the solution minus all jumps until then.
    """

    def __init__(self, settings: Kalman, anchor: GlobalPosition) -> None:
        self.local = LocalFrame(anchor)
        self._settings = settings
        self._jumps: deque[tuple[int, Array]] = deque([(0, np.zeros(3))], maxlen=_MOST_JUMPS)
        self._last: tuple[VehicleState, Array] | None = None

    def take(self, state: VehicleState) -> Array | None:
        """Take the vehicle's newest state; returns the jump (3,) in metres, if that is one."""
        if self._last is not None and state.at_ns <= self._last[0].at_ns:
            return None
        place = np.array(self.local.ned_of(state.position))
        before, self._last = self._last, (state, place)
        if before is None or seconds(state.at_ns - before[0].at_ns) > _LONGEST_STEP_S:
            return None
        velocity = 0.5 * np.add(before[0].velocity_ned_mps, state.velocity_ned_mps)
        jump: Array = place - before[1] - velocity * seconds(state.at_ns - before[0].at_ns)
        if float(jump @ jump) < self._settings.jump_m**2:
            return None
        self._jumps.append((state.at_ns, self._jumps[-1][1] + jump))
        return jump

    def reanchor(self, origin: GlobalPosition) -> None:
        """Go on in a frame at another origin; the jumps stay as they are, north being north within a hundredth of a degree."""
        self.local = LocalFrame(origin)
        if self._last is not None:
            self._last = (self._last[0], np.array(self.local.ned_of(self._last[0].position)))

    @property
    def newest(self) -> VehicleState | None:
        """The vehicle's newest state."""
        return None if self._last is None else self._last[0]

    def offset_at(self, at_ns: int) -> Array:
        """All jumps until a time, UTC ns, (3,), metres."""
        for jumped_at_ns, total in reversed(self._jumps):
            if jumped_at_ns <= at_ns:
                return total
        return self._jumps[0][1]

    def continuous(self, position: GlobalPosition, at_ns: int) -> Array:
        """A place that was named in the solution of a time, UTC ns, in continuous coordinates, (3,), metres."""
        return np.array(self.local.ned_of(position)) - self.offset_at(at_ns)

    def in_solution(self, place_m: Array, at_ns: int) -> GlobalPosition:
        """A place in continuous coordinates as it is called in the solution of a time, UTC ns.

        Raises:
            ValueError: If it is no place on earth.
        """
        north, east, down = (place_m + self.offset_at(at_ns)).tolist()
        return self.local.point_at(north, east, down)
