"""Densities of the error before and after the correction (the paper's Figure 13)."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from station.report.figures.density import density
from station.report.figures.published import SIGMA_MEAN_M, SIGMA_MEDIAN_M, SIGMA_RAW_M
from station.report.figures.static_records import Array
from station.report.figures.vector_file import PAGE_IN, VectorFiles, print_figure, write_vector
from station.report.palette import LIGHT

_PUBLISHED_M: Mapping[str, tuple[float, float, float]] = {
    "raw": SIGMA_RAW_M,
    "mean": SIGMA_MEAN_M,
    "median": SIGMA_MEDIAN_M,
}
_AXES = ("north", "east", "down")


def correction_densities(errors_ned_m: Mapping[str, Array], directory: Path) -> VectorFiles:
    """One row a correction, one column a coordinate: histogram, density and the normal curve of the same mean and sigma.

    Args:
        errors_ned_m: Measured minus true, (N, 3), metres, by the name of the correction: `raw`, `mean` and `median` are
            shown beside the paper's, others (such as `extrinsic`) alone.
        directory: Where `figure_13_densities.svg` and `.pdf` go.
    """
    with print_figure(PAGE_IN, 1.75 * len(errors_ned_m) + 0.3) as drawn:
        rows = drawn.subplots(len(errors_ned_m), 3, squeeze=False)
        for row, (name, error_m) in zip(rows, errors_ned_m.items(), strict=True):
            for column, axes in enumerate(row):
                published_m = _PUBLISHED_M[name][column] if name in _PUBLISHED_M else None
                _density(axes, 100 * error_m[:, column], published_m)
            row[0].set_ylabel(f"{name}\ndensity [1/cm]")
        for axes, name in zip(rows[-1], _AXES, strict=True):
            axes.set_xlabel(f"error {name} [cm]")
        handles, labels = rows[0, 0].get_legend_handles_labels()
        drawn.legend(handles, labels, loc="outside upper center", ncols=3)
        return write_vector(drawn, directory, "figure_13_densities")


def _density(axes: Axes, error_cm: Array, published_sigma_m: float | None) -> None:
    axes.hist(error_cm, bins=50, density=True, color=LIGHT.faint, label="samples")
    grid_cm, height = density(error_cm)
    axes.plot(grid_cm, height, color=LIGHT.estimate, label="density")
    mean_cm, sigma_cm = float(error_cm.mean()), float(error_cm.std())
    if sigma_cm > 0.0:
        normal = np.exp(-0.5 * ((grid_cm - mean_cm) / sigma_cm) ** 2) / (sigma_cm * np.sqrt(2 * np.pi))
        axes.plot(grid_cm, normal, color=LIGHT.setpoint, linestyle="--", label="normal, same mean and sigma")
    beside = "" if published_sigma_m is None else f" (paper {100 * published_sigma_m:.2f})"
    axes.set_title(f"μ {mean_cm:.2f}, σ {sigma_cm:.2f}{beside}", fontsize=7.5, fontweight="normal", loc="center")
    axes.set_yticks([])
    axes.grid(visible=False, axis="y")
