"""Measured against true positions from above (the paper's Figure 8)."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from station.report.figures.static_records import StaticRecord
from station.report.figures.vector_file import COLUMN_IN, VectorFiles, print_figure, write_vector
from station.report.palette import LIGHT
from station.report.svg import dots

_LEFT_OUT = 5


def error_by_position(records: Sequence[StaticRecord], directory: Path) -> VectorFiles:
    """Every hover's samples by vision and by navigation, the line from the pad through each group of centroids.

    Args:
        records: All hovers.
        directory: Where `figure_08_positions.svg` and `.pdf` go.
    """
    with print_figure(COLUMN_IN, COLUMN_IN + 0.2) as drawn:
        axes = drawn.subplots()
        for record in records:
            samples = record.measured_ned_m[::_LEFT_OUT]
            dots(axes, samples[:, 1], samples[:, 0], 1.2, LIGHT.raw, "_vision", alpha=0.25)
            if record.navigated_ned_m is not None:
                flown = record.navigated_ned_m[::_LEFT_OUT]
                dots(axes, flown[:, 1], flown[:, 0], 1.2, LIGHT.estimate, "_navigation", alpha=0.4)
            centre, true = record.measured_ned_m.mean(axis=0), record.true_ned_m
            axes.plot([true[1], centre[1]], [true[0], centre[0]], color=LIGHT.ink, linewidth=0.9)
        true_m = np.array([record.true_ned_m for record in records])
        centroids_m = np.array([record.measured_ned_m.mean(axis=0) for record in records])
        for places, colour, name in (
            (true_m, LIGHT.estimate, "true"),
            (centroids_m, LIGHT.raw, "vision, centroid"),
        ):
            axes.plot(places[:, 1], places[:, 0], "o", color=colour, markersize=3.2, markeredgewidth=0, label=name)
        axes.plot([], [], color=LIGHT.ink, linewidth=0.9, label="error")
        axes.set_aspect("equal")
        axes.set_xlabel("east of the pad [m]")
        axes.set_ylabel("north of the pad [m]")
        drawn.legend(loc="outside upper center", ncols=3)
        return write_vector(drawn, directory, "figure_08_positions")
