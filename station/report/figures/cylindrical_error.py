"""Error in azimuth and radius (the paper's Figure 11)."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from station.report.figures.published import AZIMUTH_BIAS_DEG
from station.report.figures.static_records import StaticRecord
from station.report.figures.vector_file import PAGE_IN, VectorFiles, print_figure, write_vector
from station.report.figures.whiskers import whiskers
from station.report.palette import LIGHT
from station.report.svg import dots


def cylindrical_error(records: Sequence[StaticRecord], directory: Path) -> VectorFiles:
    """Scatter of radial over angular error, and boxes of both; hovers above the pad's centre have no azimuth.

    Args:
        records: All hovers.
        directory: Where `figure_11_cylindrical.svg` and `.pdf` go.
    """
    parts = [record.cylindrical_error for record in records if record.distance_m > 0.0]
    angular_deg = np.degrees(np.concatenate([angle for angle, _ in parts]))
    radial_cm = 100 * np.concatenate([radius for _, radius in parts])
    with print_figure(PAGE_IN, 2.9) as drawn:
        scatter, angles, radii = drawn.subplots(1, 3, width_ratios=(2.0, 1.0, 1.0))
        dots(scatter, angular_deg, radial_cm, 1.2, LIGHT.raw, "_samples", alpha=0.25)
        for axes in (scatter, angles):
            line = axes.axvline if axes is scatter else axes.axhline
            line(AZIMUTH_BIAS_DEG, color=LIGHT.setpoint, linestyle="--", label=f"paper {AZIMUTH_BIAS_DEG:.2f}°")
        scatter.axvline(
            float(angular_deg.mean()), color=LIGHT.estimate, linestyle="-", label=f"ours {angular_deg.mean():.2f}°"
        )
        scatter.set_xlabel("error of the azimuth [°]")
        scatter.set_ylabel("error of the radius [cm]")
        handles, labels = scatter.get_legend_handles_labels()
        drawn.legend(handles, labels, loc="outside upper center", ncols=2)
        whiskers(angles, [angular_deg], ["azimuth"])
        angles.set_ylabel("error [°]")
        whiskers(radii, [radial_cm], ["radius"])
        radii.set_ylabel("error [cm]")
        return write_vector(drawn, directory, "figure_11_cylindrical")
