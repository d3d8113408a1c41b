"""How far the pad was measured from where it is, by height."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes

from station.metrics.pad_error import PadError
from station.metrics.summary import FlightSummary
from station.report.svg import CORRECTED, ESTIMATE, INK, RAW, figure, inline_svg

_BINS = 14


def error_view(summary: FlightSummary) -> str | None:
    """Horizontal and vertical error over height, as SVG; None where there is no ground truth."""
    errors = summary.errors
    if not (errors.raw or errors.corrected or errors.estimate):
        return None
    with figure(11.0, 4.0, "error") as drawn:
        horizontal, vertical = drawn.subplots(1, 2)
        for series, colour, name in (
            (errors.raw, RAW, "fix, uncorrected"),
            (errors.corrected, CORRECTED, "fix, corrected"),
            (errors.estimate, ESTIMATE, "estimate"),
        ):
            _draw(horizontal, series, lambda error: 100 * error.horizontal_m, colour, name)
            _draw(vertical, series, lambda error: 100 * error.ned_m[2], colour, name)
        horizontal.set_title("Horizontal error")
        horizontal.set_ylabel("error [cm]")
        horizontal.set_ylim(bottom=0)
        vertical.set_title("Vertical error (measured too low is positive)")
        vertical.axhline(0, color=INK, linewidth=0.8)
        for axes in (horizontal, vertical):
            axes.set_xlabel("true height above the pad [m]")
            axes.invert_xaxis()
        handles, labels = horizontal.get_legend_handles_labels()
        drawn.legend(handles, labels, loc="outside lower center", ncols=3)
        return inline_svg(drawn, "Errors of fixes and estimates over the height above the pad")


def _draw(
    axes: Axes, errors: tuple[PadError, ...], value_of: Callable[[PadError], float], colour: str, name: str
) -> None:
    if not errors:
        return
    heights_m = np.array([error.height_m for error in errors])
    values = np.array([value_of(error) for error in errors])
    axes.scatter(heights_m, values, s=6, color=colour, alpha=0.35, linewidths=0)
    edges_m = np.linspace(heights_m.min(), heights_m.max() + 1e-9, _BINS + 1)
    group = np.digitize(heights_m, edges_m)
    filled = [number for number in range(1, _BINS + 1) if np.any(group == number)]
    middles = [float(np.median(heights_m[group == number])) for number in filled]
    axes.plot(middles, [float(np.median(values[group == number])) for number in filled], color=colour, label=name)
