"""How far a replayed value may be from the recorded one."""

import re
from dataclasses import dataclass, field

NOT_COMPARED = float("inf")


@dataclass(frozen=True)
class Tolerances:
    """Absolute tolerances by the kind of a field; a field of no kind listed has to be the same to the last bit."""

    name: str
    """For people."""
    kinds: tuple[tuple[re.Pattern[str], float], ...] = ()
    """Pattern of the field's path, such as `raw.position.latitude_deg`, and tolerance in the field's own unit; the first match counts."""
    _known: dict[str, float] = field(default_factory=dict, repr=False, compare=False)

    def of(self, path: str) -> float:
        """The tolerance of one field."""
        if path not in self._known:
            self._known[path] = next((tolerance for pattern, tolerance in self.kinds if pattern.search(path)), 0.0)
        return self._known[path]


EXACT = Tolerances("exact")
"""The same to the last bit: what the same inputs, the same code and the same machine yield."""


def _kinds(**tolerances: tuple[str, float]) -> tuple[tuple[re.Pattern[str], float], ...]:
    return tuple((re.compile(pattern), tolerance) for pattern, tolerance in tolerances.values())


ROUNDING = Tolerances(
    "rounding",
    _kinds(
        covariance=(r"covariance|variance|noise", 1e-7),
        quality=(r"reprojection_error_px|ambiguity|sigma|nis$", 1e-3),
        pixel=(r"_px(\[\d+\])*$", 1e-3),
        geodetic=(r"(latitude|longitude)_deg", 1e-11),
        length=(r"_m(\[\d+\])?$", 1e-6),
        speed=(r"_mps(\[\d+\])?$", 1e-6),
        attitude=(r"q_\w+\[\d+\]$", 1e-6),
        angle=(r"_rad$", 1e-6),
    ),
)
"""For another machine: OpenCV and NumPy take other instructions there, which round otherwise. What is decided has to be the same."""

LOSSY = Tolerances(
    "lossy pictures",
    _kinds(
        confidence=(r"covariance|variance|sigma|noise|shared|reprojection_error_px|ambiguity|nis$", NOT_COMPARED),
        attitude=(r"q_\w+\[\d+\]$", NOT_COMPARED),
        words=(r"(^|\.)detail$", NOT_COMPARED),
        count=(r"(^|\.)poses$", NOT_COMPARED),
        pixel=(r"_px(\[\d+\])*$", 1.0),
        geodetic=(r"(latitude|longitude)_deg", 3e-6),
        length=(r"_m(\[\d+\])?$", 0.3),
        speed=(r"_mps(\[\d+\])?$", 0.1),
        angle=(r"_rad$", 0.05),
    ),
)
"""For pictures that were compressed with loss after the detector had seen them, or of which not all were kept. What says how sure somebody is, and what puts numbers
into words, is not compared, nor is the attitude of the two planar poses, of which either may come first, nor whether there are two: from straight above, hundredths of a
pixel decide whether they are one."""

BY_NAME = {"exact": EXACT, "rounding": ROUNDING, "lossy": LOSSY}
"""What `--tolerance` takes."""
