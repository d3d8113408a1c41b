"""Error of the height (the paper's Figure 10)."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from station.report.figures.density import density
from station.report.figures.published import DOWN_BIAS_M, DOWN_BIAS_MEDIAN_M
from station.report.figures.static_records import StaticRecord
from station.report.figures.vector_file import PAGE_IN, VectorFiles, print_figure, write_vector
from station.report.figures.whiskers import whiskers
from station.report.palette import LIGHT


def altitude_error(records: Sequence[StaticRecord], directory: Path) -> VectorFiles:
    """Box of the error of the height above the pad (measured minus true), and its density for each hover, in centimetres.

    Args:
        records: All hovers.
        directory: Where `figure_10_altitude.svg` and `.pdf` go.
    """
    each_cm = [-100 * record.error_ned_m[:, 2] for record in records]
    with print_figure(PAGE_IN, 2.9) as drawn:
        box, densities = drawn.subplots(1, 2, width_ratios=(1.0, 2.4), sharey=True)
        whiskers(box, [np.concatenate(each_cm)], ["all hovers"])
        for error_cm in each_cm:
            grid_cm, height = density(error_cm)
            densities.plot(height, grid_cm, color=LIGHT.estimate, linewidth=0.7, alpha=0.6)
        for published_m, style, name in (
            (DOWN_BIAS_M, "--", "paper, mean"),
            (DOWN_BIAS_MEDIAN_M, ":", "paper, median"),
        ):
            for axes in (box, densities):
                axes.axhline(100 * published_m, color=LIGHT.setpoint, linestyle=style, label=name)
        densities.plot([], [], color=LIGHT.estimate, linewidth=0.7, label="one hover each")
        densities.set_xlim(left=0)
        densities.set_xlabel("density [1/cm]")
        box.set_ylabel("error of the height above the pad [cm]")
        handles, labels = densities.get_legend_handles_labels()
        drawn.legend(handles, labels, loc="outside upper center", ncols=3)
        return write_vector(drawn, directory, "figure_10_altitude")
