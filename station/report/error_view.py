"""How far the pad was measured from where it is, by height."""

from collections.abc import Callable
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from station.metrics.pad_error import PadError
from station.metrics.summary import FlightSummary, PadErrors
from station.report.picture import Picture
from station.report.svg import PAGE, dots

_BINS = 14


def error_picture(summary: FlightSummary) -> Picture | None:
    """Horizontal and vertical error over height; None where there is no ground truth."""
    errors = summary.errors
    if not (errors.raw or errors.corrected or errors.estimate):
        return None
    title = "Errors of fixes and estimates over the height above the pad"
    return Picture("error", title, 3.9, 6.6, partial(_draw, errors))


def _draw(errors: PadErrors, drawn: Figure, narrow: bool) -> None:
    horizontal, vertical = drawn.subplots(2, 1) if narrow else drawn.subplots(1, 2)
    for series, colour, name in (
        (errors.raw, PAGE.raw, "fix, uncorrected"),
        (errors.corrected, PAGE.corrected, "fix, corrected"),
        (errors.estimate, PAGE.estimate, "estimate"),
    ):
        _series(horizontal, series, lambda error: 100 * error.horizontal_m, colour, name)
        _series(vertical, series, lambda error: 100 * error.ned_m[2], colour, name)
    horizontal.set_title("Horizontal error")
    horizontal.set_ylim(bottom=0)
    vertical.set_title("Vertical error (down is positive)")
    vertical.axhline(0, color=PAGE.ink, linewidth=0.8)
    for axes in (horizontal, vertical):
        axes.set_ylabel("error [cm]")
        axes.set_xlabel("true height above the pad [m]")
        axes.invert_xaxis()
    handles, labels = horizontal.get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside lower center", ncols=2 if narrow else 3)


def _series(
    axes: Axes, errors: tuple[PadError, ...], value_of: Callable[[PadError], float], colour: str, name: str
) -> None:
    if not errors:
        return
    heights_m = np.array([error.height_m for error in errors])
    values = np.array([value_of(error) for error in errors])
    dots(axes, heights_m, values, 2.6, colour, f"_{name}", alpha=0.4)
    edges_m = np.linspace(heights_m.min(), heights_m.max() + 1e-9, _BINS + 1)
    group = np.digitize(heights_m, edges_m)
    filled = [number for number in range(1, _BINS + 1) if np.any(group == number)]
    middles = [float(np.median(heights_m[group == number])) for number in filled]
    axes.plot(middles, [float(np.median(values[group == number])) for number in filled], color=colour, label=name)
