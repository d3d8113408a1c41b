"""Whether a calibration may be used: every reason why not."""

import math
from collections.abc import Iterator

from station.calibrate.coverage import Coverage
from station.calibrate.solve import Solution
from station.calibrate.views import Chosen

LEAST_VIEWS = 6
LEAST_COVERED = 0.6
"""Part of the picture in which corners must have been seen."""
LEAST_TILT_RAD = math.radians(15.0)
"""Seen straight on, a near board and a short lens look like a far board and a long lens."""
LEAST_TILTED = 3
WORST_FOCAL = 0.02
"""Standard deviation of a focal length, as a part of it: it goes into every distance."""
WORST_HELD_OUT_PX = 1.5


def complaints_before(pictures: int, found: int, chosen: Chosen, coverage: Coverage) -> Iterator[str]:
    """What is wrong with the views themselves; solving is no use then."""
    if found < LEAST_VIEWS:
        yield f"too few: the board was found in {found} of {pictures} pictures, {LEAST_VIEWS} are needed; is --board right?"
        return
    if len(chosen.used) < LEAST_VIEWS:
        if len(chosen.alike) >= len(chosen.blurred):
            yield (
                f"too alike: the board is in {found} pictures, but only {len(chosen.used)} places of it differ; "
                f"move it all over the picture, near and far, turned and tilted"
            )
        else:
            yield f"too blurred: {len(chosen.blurred)} of {found} views; hold still, more light, shorter exposure"
    zones = coverage.empty_zones()
    if zones:
        yield f"corners of the picture not covered: {', '.join(zones)}; hold the board there, too"
    if coverage.covered < LEAST_COVERED:
        yield f"corners were seen in {100 * coverage.covered:.0f} % of the picture, {100 * LEAST_COVERED:.0f} % are needed"


def complaints_after(solution: Solution) -> Iterator[str]:
    """What is wrong with the solution."""
    tilted = sum(tilt >= LEAST_TILT_RAD for tilt in solution.tilts_rad)
    if tilted < LEAST_TILTED:
        yield (
            f"no tilt: {tilted} views show the board tilted by {math.degrees(LEAST_TILT_RAD):.0f} deg or more, {LEAST_TILTED} are needed: "
            "without, the focal length cannot be told from the distance"
        )
    worst = max(float(solution.sigmas[axis] / solution.values[axis]) for axis in (0, 1))
    if worst > WORST_FOCAL:
        yield (
            f"uncertain: the focal length is known to {100 * worst:.1f} %, {100 * WORST_FOCAL:.0f} % are needed; more views, "
            "more of them tilted"
        )
    if solution.held_out_rms_px > WORST_HELD_OUT_PX:
        yield (
            f"views that were left out do not fit: {solution.held_out_rms_px:.2f} px, at most {WORST_HELD_OUT_PX:g}; "
            "is the board flat, and the lens no fish-eye?"
        )
