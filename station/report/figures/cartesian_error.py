"""Error in north and east (the paper's Figure 9)."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from station.report.figures.published import SIGMA_RAW_M
from station.report.figures.static_records import StaticRecord
from station.report.figures.vector_file import PAGE_IN, VectorFiles, print_figure, write_vector
from station.report.figures.whiskers import whiskers
from station.report.palette import LIGHT
from station.report.svg import dots


def cartesian_error(records: Sequence[StaticRecord], directory: Path) -> VectorFiles:
    """Scatter and boxes (whiskers at 1.5 times the quartiles' distance) of the horizontal error, in centimetres.

    Args:
        records: All hovers.
        directory: Where `figure_09_cartesian.svg` and `.pdf` go.
    """
    error_cm = 100 * np.concatenate([record.error_ned_m for record in records])
    with print_figure(PAGE_IN, 3.1) as drawn:
        scatter, boxes = drawn.subplots(1, 2, width_ratios=(1.0, 1.1))
        dots(scatter, error_cm[:, 1], error_cm[:, 0], 1.2, LIGHT.raw, "_samples", alpha=0.25)
        scatter.axhline(0, color=LIGHT.muted, linewidth=0.7)
        scatter.axvline(0, color=LIGHT.muted, linewidth=0.7)
        scatter.set_aspect("equal", adjustable="datalim")
        scatter.set_xlabel("error east [cm]")
        scatter.set_ylabel("error north [cm]")
        whiskers(boxes, [error_cm[:, 0], error_cm[:, 1]], ["north", "east"])
        for place, published_m in zip((1, 2), SIGMA_RAW_M[:2], strict=True):
            ours_cm, published_cm = float(error_cm[:, place - 1].std()), 100 * published_m
            boxes.plot([place + 0.38] * 2, [-published_cm, published_cm], color=LIGHT.setpoint, linewidth=2.4)
            boxes.annotate(
                f"σ {ours_cm:.1f} cm\n(paper {published_cm:.1f})", (place, 1.0), xycoords=("data", "axes fraction"),
                ha="center", va="bottom", fontsize=7.5,
            )  # fmt: skip
        boxes.plot([], [], color=LIGHT.setpoint, linewidth=2.4, label="paper: ± one sigma")
        boxes.set_ylabel("error [cm]")
        drawn.legend(loc="outside lower right")
        return write_vector(drawn, directory, "figure_09_cartesian")
