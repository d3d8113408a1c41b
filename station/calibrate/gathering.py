"""Gathering views from a live camera: which are worth keeping, what is still missing, and when there are enough."""

from dataclasses import dataclass

import numpy as np

from station.calibrate.coverage import Coverage
from station.calibrate.judge import LEAST_VIEWS, complaints_after, complaints_before
from station.calibrate.solve import SolveError, solve
from station.calibrate.views import ALIKE, View, choose_views

ENOUGH_VIEWS = 20
"""Fewer are not solved while pictures still come."""
MOST_KEPT = 150

_SOLVE_EVERY = 5
_SHARPER = 0.8
_SETTLE = 0.35
"""Between two pictures, a board held still moves by less than this part of what makes views differ."""


@dataclass(frozen=True)
class Verdict:
    """What became of one picture."""

    kept: bool
    why: str


class Gathering:
    """Keeps sharp, varied views of a board, taken while it was held still."""

    def __init__(self, size_px: tuple[int, int]) -> None:
        """Begin with none; all pictures have one size, pixels."""
        self.size_px = size_px
        """Width and height of all pictures."""
        self._kept: list[View] = []
        self._last: View | None = None
        self._pictures = self._found = 0
        self._new = 0
        self._missing = "show the board to the camera"
        self.enough = False
        """Whether a calibration from these views would be accepted."""

    @property
    def views(self) -> tuple[View, ...]:
        """Those kept."""
        return tuple(self._kept)

    @property
    def pictures(self) -> int:
        """How many pictures there were."""
        return self._pictures

    @property
    def missing(self) -> str:
        """What to do next, for the person who holds the board."""
        return self._missing

    def coverage(self) -> Coverage:
        """Where corners were seen in the views that would be used."""
        coverage = Coverage(self.size_px)
        coverage.add(choose_views(self._kept).used)
        return coverage

    def take(self, view: View | None) -> Verdict:
        """Look at the next picture's view; None if the board is not in it."""
        self._pictures += 1
        before, self._last = self._last, view
        if view is None:
            return Verdict(False, "no board")
        self._found += 1
        if before is None or _apart(before, view) > _SETTLE * ALIKE:
            return Verdict(False, "moving")
        alike = [each for each in self._kept if _apart(each, view) < ALIKE]
        if any(view.blur_px > _SHARPER * each.blur_px for each in alike):
            return Verdict(False, "like another")
        if len(self._kept) >= MOST_KEPT and not alike:
            return Verdict(False, "enough of them")
        self._kept = [each for each in self._kept if not any(each is other for other in alike)]
        self._kept.append(view)
        self._new += 1
        self._judge()
        return Verdict(True, "sharper than another" if alike else "new")

    def _judge(self) -> None:
        """Ask the judge of calibrations what would still be wrong; solving takes long, so not at every view."""
        chosen, coverage = choose_views(self._kept), self.coverage()
        complaints: list[str] = []
        if len(chosen.used) >= LEAST_VIEWS:
            complaints += complaints_before(self._pictures, len(self._kept), chosen, coverage)
        if len(chosen.used) < ENOUGH_VIEWS:
            complaints.append(
                f"{len(chosen.used)} of {ENOUGH_VIEWS} views; hold the board elsewhere, near, far, tilted"
            )
        if complaints:
            self._missing = complaints[0]
            return
        if self._new < _SOLVE_EVERY:
            return
        self._new = 0
        try:
            complaints = list(complaints_after(solve(chosen.used, self.size_px)))
        except SolveError as error:
            complaints = [str(error)]
        self._missing = complaints[0] if complaints else ""
        self.enough = not complaints


def _apart(one: View, other: View) -> float:
    return float(np.linalg.norm(one.description - other.description))
