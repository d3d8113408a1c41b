"""How far fixes and estimates were from the true pad, by height."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from schemas.message import Vector3
from station.metrics.truth_track import TruthTrack


@dataclass(frozen=True)
class PadError:
    """One measured vector from the vehicle to the pad against the true one at capture time."""

    captured_at_ns: int
    height_m: float
    """True height of the vehicle above the pad, metres."""
    ned_m: Vector3
    """Measured minus true, north, east, down, metres."""

    @property
    def horizontal_m(self) -> float:
        """Length of the horizontal part, metres."""
        return float(np.hypot(self.ned_m[0], self.ned_m[1]))


def pad_errors(measured: Iterable[tuple[int, Vector3]], truth: TruthTrack) -> tuple[PadError, ...]:
    """Compare measurements (capture time in UTC ns, vehicle to pad in NED metres) with the truth, where there is any."""
    errors = []
    for captured_at_ns, pad_ned_m in measured:
        vehicle_ned_m = truth.at(captured_at_ns)
        if vehicle_ned_m is not None:
            north, east, down = (np.asarray(pad_ned_m) + vehicle_ned_m).tolist()
            errors.append(PadError(captured_at_ns, -float(vehicle_ned_m[2]), (north, east, down)))
    return tuple(errors)


def rms_horizontal_m(errors: Iterable[PadError]) -> float | None:
    """Root mean square of the horizontal errors, metres; None of nothing."""
    lengths_m = [error.horizontal_m for error in errors]
    return float(np.sqrt(np.mean(np.square(lengths_m)))) if lengths_m else None
