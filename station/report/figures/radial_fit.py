"""Radial error over distance, with the fitted line (the paper's Figure 12)."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from station.biases.line_fit import fitted_line
from station.report.figures.published import RADIAL_OFFSET_M, RADIAL_R2, RADIAL_SLOPE
from station.report.figures.static_records import StaticRecord
from station.report.figures.vector_file import COLUMN_IN, VectorFiles, print_figure, write_vector
from station.report.palette import LIGHT
from station.report.svg import dots

_LEFT_OUT = 5


def radial_fit(records: Sequence[StaticRecord], directory: Path) -> VectorFiles:
    """Samples, each position's centroid, our line through the centroids and the paper's.

    Args:
        records: All hovers.
        directory: Where `figure_12_radial.svg` and `.pdf` go.
    """
    distance_m = np.array([record.distance_m for record in records])
    centroid_m = np.array([record.cylindrical_error[1].mean() for record in records])
    line = fitted_line(distance_m, centroid_m)
    ends_m = np.array([0.0, 1.05 * distance_m.max()])
    with print_figure(COLUMN_IN, 2.9) as drawn:
        axes = drawn.subplots()
        for record in records:
            radial_cm = 100 * record.cylindrical_error[1][::_LEFT_OUT]
            dots(
                axes, np.full(len(radial_cm), record.distance_m), radial_cm, 1.2, LIGHT.navigated, "_samples", alpha=0.2
            )
        axes.plot(
            distance_m, 100 * centroid_m, "+", color=LIGHT.bad, markersize=7, markeredgewidth=1.4, label="centroid"
        )
        for slope, offset_m, r2, colour, style, name in (
            (line.slope, line.offset, line.r2, LIGHT.estimate, "-", "ours"),
            (RADIAL_SLOPE, RADIAL_OFFSET_M, RADIAL_R2, LIGHT.setpoint, "--", "paper"),
        ):
            label = f"{name}: {100 * slope:.2f} % of r + {100 * offset_m:.1f} cm, r² {r2:.2f}"
            axes.plot(ends_m, 100 * (offset_m + slope * ends_m), color=colour, linestyle=style, label=label)
        axes.set_xlim(0, ends_m[1])
        axes.set_xlabel("horizontal distance r from the pad [m]")
        axes.set_ylabel("error of the radius [cm]")
        drawn.legend(loc="outside upper center", ncols=1)
        return write_vector(drawn, directory, "figure_12_radial")
