"""The comparison as vector figures."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from station.experiment.consistency import mean_bounds
from station.experiment.filter_comparison import FIXES, HEIGHTS_M, LATEST, Comparison, Contestant
from station.report.figures.vector_file import PAGE_IN, VectorFiles, print_figure, write_vector
from station.report.palette import LIGHT

_COLOURS = (LIGHT.corrected, LIGHT.estimate, LIGHT.setpoint, LIGHT.raw, LIGHT.camera, LIGHT.navigated, LIGHT.truth)


def write_figures(result: Comparison, directory: Path) -> tuple[VectorFiles, ...]:
    """Error by height and consistency by height, as SVG and PDF.

    Raises:
        ReportError: If they cannot be written.
    """
    shown = [one for one in result.contestants.values() if one.flights]
    honest = [one for one in shown if LATEST not in one.name]
    with print_figure(PAGE_IN, 3.2) as drawn:
        error, consistency = drawn.subplots(1, 2)
        _draw_errors(error, shown)
        _draw_nees(consistency, honest, result.count)
        return (write_vector(drawn, directory, "filters"),)


def _draw_errors(axes: Axes, shown: list[Contestant]) -> None:
    for one, colour in zip(shown, _COLOURS, strict=False):
        points = [(height, one.at_height(height)) for height in HEIGHTS_M]
        heights = [height for height, claims in points if claims]
        rmse_cm = [
            100.0 * float(np.sqrt(np.mean([claim.error_m @ claim.error_m for claim in claims])))
            for _, claims in points
            if claims
        ]
        axes.plot(heights, rmse_cm, color=colour, label=one.name, linestyle="--" if LATEST in one.name else "-")
    axes.set(xlabel="height above the pad, m", ylabel="RMSE, cm", title="Error of the vector to the pad", yscale="log")
    axes.legend(frameon=False)


def _draw_nees(axes: Axes, shown: list[Contestant], count: int) -> None:
    low, high = mean_bounds(max(count, 1))
    axes.axhspan(low, high, color=LIGHT.faint, label="95 % bounds")
    for one, colour in zip(shown, _COLOURS, strict=False):
        points = [(height, value.mean) for height in HEIGHTS_M if (value := one.nees_at(height)) is not None]
        axes.plot(*zip(*points, strict=True), color=colour, marker="." if one.name == FIXES else None, label=one.name)
    axes.set(xlabel="height above the pad, m", ylabel="mean NEES", title="Honesty of the covariance (3 is honest)")
    axes.set_ylim(0.0, 6.0)
    axes.legend(frameon=False)
