"""The vehicle's navigation solution as a local frame that neither jumps nor leads too far from its origin."""

from collections import deque

from alight.geometry.local_frame import LocalFrame
from alight.geometry.solution_jump import solution_jump_ned_m
from schemas.message import GlobalPosition, Vector3
from schemas.settings.filter import Kalman
from schemas.vehicle import VehicleState

_MOST_JUMPS = 16


class NavigationFrame:
    """Anchored at the first fix. Between two vehicle states the position changes by what the velocity explains, or the solution jumped.

    PX4's estimator resets its position now and then; the commander's setpoints and all coordinates then mean another place.
    Continuous coordinates = coordinates in the solution minus all jumps until then.
    """

    def __init__(self, settings: Kalman, anchor: GlobalPosition) -> None:
        self.local = LocalFrame(anchor)
        self._settings = settings
        self._jumps: deque[tuple[int, Vector3]] = deque([(0, (0.0, 0.0, 0.0))], maxlen=_MOST_JUMPS)
        self._last: tuple[VehicleState, Vector3] | None = None

    def take(self, state: VehicleState) -> Vector3 | None:
        """Take the vehicle's newest state; returns the jump in metres, if that is one."""
        if self._last is not None and state.at_ns <= self._last[0].at_ns:
            return None
        place = self.local.ned_of(state.position)
        before, self._last = self._last, (state, place)
        if before is None:
            return None
        (n0, e0, d0), (n, e, d) = before[1], place
        jump = solution_jump_ned_m(before[0], state, (n - n0, e - e0, d - d0), self._settings.jump_m)
        if jump is None:
            return None
        self._jumps.append((state.at_ns, _sum(self._jumps[-1][1], jump)))
        return jump

    def reanchor(self, origin: GlobalPosition) -> None:
        """Go on in a frame at another origin; the jumps stay as they are, north being north within a hundredth of a degree."""
        self.local = LocalFrame(origin)
        if self._last is not None:
            self._last = (self._last[0], self.local.ned_of(self._last[0].position))

    @property
    def newest(self) -> VehicleState | None:
        """The vehicle's newest state."""
        return None if self._last is None else self._last[0]

    def offset_at(self, at_ns: int) -> Vector3:
        """All jumps until a time, UTC ns, metres."""
        for jumped_at_ns, total in reversed(self._jumps):
            if jumped_at_ns <= at_ns:
                return total
        return self._jumps[0][1]

    def continuous(self, position: GlobalPosition, at_ns: int) -> Vector3:
        """A place that was named in the solution of a time, UTC ns, in continuous coordinates, metres."""
        (n, e, d), (jn, je, jd) = self.local.ned_of(position), self.offset_at(at_ns)
        return (n - jn, e - je, d - jd)

    def in_solution(self, place_m: Vector3, at_ns: int) -> GlobalPosition:
        """A place in continuous coordinates as it is called in the solution of a time, UTC ns.

        Raises:
            ValueError: If it is no place on earth.
        """
        return self.local.point_at(*_sum(place_m, self.offset_at(at_ns)))


def _sum(a: Vector3, b: Vector3) -> Vector3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
