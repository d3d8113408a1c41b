"""The landing metrics of the paper: distance (Eq. 29), time (Eq. 30) and accuracy (Eq. 28), from the autopilot's positions.

The paper works on the autopilot's log and takes the pad's position as known. So do these: they hold what the vehicle
believed, its navigation error included. What really happened is in `touchdown`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alight.geometry.local import ned_between
from alight.runtime.clock import seconds
from schemas.message import GlobalPosition
from schemas.vehicle import VehicleState
from station.metrics.phases import LandingPart

PROXIMITY = 0.002
"""Eq. 30: 99.8 % of the start altitude begins the landing, and the same 0.2 % of it ends it."""
LAST_POSITIONS = 10


@dataclass(frozen=True)
class PaperMetrics:
    """One landing in the paper's terms (Tables 6 and 7)."""

    started_at_ns: int
    """First sample below 99.8 % of the start height that moves down (Eq. 30), UTC ns."""
    reached_at_ns: int | None
    """First sample within 0.2 % of the start height of the height at rest, UTC ns; None if it never came down."""
    distance_m: float
    """Sum of the steps between the logged positions from start to end (Eq. 29), metres."""
    straight_line_m: float
    """From the first of these positions to the pad, metres."""
    start_height_m: float
    """Height at the start above the height at rest, metres."""
    rmse_m: float
    """Root mean square horizontal distance of the last ten logged positions from the pad (Eq. 28), metres."""
    rmse_1e7_deg: float
    """The same in latitude and longitude together, 1e-7 degrees: the unit of the paper's tables."""

    @property
    def time_s(self) -> float | None:
        """Time to land (Eq. 30), seconds."""
        return None if self.reached_at_ns is None else seconds(self.reached_at_ns - self.started_at_ns)


def paper_metrics(states: Sequence[VehicleState], pad: GlobalPosition, part: LandingPart) -> PaperMetrics | None:
    """Measure a landing.

    Args:
        states: The logged vehicle states, ascending in time.
        pad: Where the pad is.
        part: Which part of the flight is the landing.

    Returns:
        None if no state of the landing moves down below 99.8 % of the start height.
    """
    logged = [state for state in states if part.holds(state.at_ns)]
    if len(logged) < LAST_POSITIONS:
        return None
    ned_m = np.array([ned_between(pad, state.position) for state in logged])
    height_m = ned_m[-LAST_POSITIONS:, 2].mean() - ned_m[:, 2]
    start_height_m = float(height_m[0])
    sinking = np.array([state.velocity_ned_mps[2] > 0.0 for state in logged])
    start = _first((height_m < (1.0 - PROXIMITY) * start_height_m) & sinking)
    if start is None or start_height_m <= 0.0:
        return None
    reached = _first(height_m[start:] <= PROXIMITY * start_height_m) if part.landed else None
    end = len(logged) - 1 if reached is None else start + reached
    last = [state.position for state in logged[-LAST_POSITIONS:]]
    return PaperMetrics(
        started_at_ns=logged[start].at_ns,
        reached_at_ns=None if reached is None else logged[end].at_ns,
        distance_m=path_length_m(ned_m[start : end + 1]),
        straight_line_m=float(np.linalg.norm(ned_m[start])),
        start_height_m=start_height_m,
        rmse_m=float(np.sqrt(np.mean(np.sum(ned_m[-LAST_POSITIONS:, :2] ** 2, axis=1)))),
        rmse_1e7_deg=_rmse_1e7_deg(last, pad),
    )


def path_length_m(ned_m: NDArray[np.float64]) -> float:
    """Sum of the steps between positions, (N, 3) metres (Eq. 29)."""
    return float(np.linalg.norm(np.diff(ned_m, axis=0), axis=1).sum())


def _rmse_1e7_deg(positions: Sequence[GlobalPosition], pad: GlobalPosition) -> float:
    squares = [
        (position.latitude_deg - pad.latitude_deg) ** 2 + (position.longitude_deg - pad.longitude_deg) ** 2
        for position in positions
    ]
    return float(np.sqrt(np.mean(squares)) * 1e7)


def _first(condition: NDArray[np.bool_]) -> int | None:
    return int(np.argmax(condition)) if condition.any() else None
