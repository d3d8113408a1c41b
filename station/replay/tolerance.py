"""How far a replayed value may be from the recorded one."""

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerances:
    """Absolute tolerances by the kind of a field; a field of no kind listed has to be the same to the last bit."""

    name: str
    """For people."""
    kinds: tuple[tuple[re.Pattern[str], float], ...] = ()
    """Pattern of the field's path, such as `raw.position.latitude_deg`, and tolerance in the field's own unit; the first match counts."""

    def of(self, path: str) -> float:
        """The tolerance of one field."""
        return next((tolerance for pattern, tolerance in self.kinds if pattern.search(path)), 0.0)


EXACT = Tolerances("exact")
"""The same to the last bit: what the same inputs, the same code and the same machine yield."""


def _kinds(**tolerances: tuple[str, float]) -> tuple[tuple[re.Pattern[str], float], ...]:
    return tuple((re.compile(pattern), tolerance) for pattern, tolerance in tolerances.values())


LOSSY = Tolerances(
    "lossy pictures",
    _kinds(
        covariance=(r"covariance|variance|sigma", float("inf")),
        quality=(r"reprojection_error_px|ambiguity", float("inf")),
        corner=(r"corners_px", 1.0),
        geodetic=(r"(latitude|longitude)_deg", 3e-6),
        length=(r"_m(\[\d+\])?$", 0.3),
        attitude=(r"q_\w+\[\d+\]$", 0.1),
        angle=(r"_rad$", 0.05),
    ),
)
"""For pictures that were compressed with loss after the detector had seen them. Which of the two planar poses comes first, and with
it the pose's attitude, may change; what says how sure a detection is, is not compared."""
