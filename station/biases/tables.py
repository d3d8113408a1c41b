"""The paper's Tables 3 to 5 from our hovers, the published numbers beside them."""

from collections.abc import Iterator, Sequence

from station.biases.extrinsic_model import NAMES, PARAMETERS
from station.biases.quality import Quality
from station.biases.study import Study
from station.report.figures import published

_AXES = ("north", "east", "down")
_SIGMAS_M = {"raw": published.SIGMA_RAW_M, "mean": published.SIGMA_MEAN_M, "median": published.SIGMA_MEDIAN_M}
_MEANS_M = {
    "raw": (7.930e-4, 1.087e-2, -4.774e-1),
    "mean": (20.2e-4, 0.851e-2, 0.110e-1),
    "median": (17.12e-4, 0.882e-2, 0.680e-1),
}
"""Table 4, mu north, east, down."""
_RMSE_M = {
    "raw": (6.418e-2, 5.804e-2, 2.421e-2),
    "mean": (0.280e-2, 0.361e-2, 0.143e-2),
    "median": (0.298e-2, 0.361e-2, 0.188e-2),
}
"""Table 5; not consistent with Table 4: an RMSE cannot be below the mean's magnitude."""


def study_lines(study: Study) -> list[str]:
    """All tables, for a terminal."""
    return [*_table_3(study), "", *_line(study), "", *_table_4(study), "", *_table_5(study), "", *_extrinsic(study)]


def _table_3(study: Study) -> Iterator[str]:
    fit = study.cylindrical
    yield f"Table 3. Stationary error, measured minus true: {fit.records} records at {fit.positions} positions, {fit.samples} samples"
    yield from _rows(
        ("", "azimuth, deg", "paper", "radius, m", "paper", "height, m", "paper"),
        [
            _row_3("mean", fit.azimuth_deg.mean, 4.007078, fit.radius_m.mean, 0.153636, fit.height_m.mean, 0.488412),
            _row_3("median", fit.azimuth_deg.median, 4.056872, fit.radius_m.median, 0.145540, fit.height_m.median, 0.5454),
            _row_3("variance", fit.azimuth_deg.variance, 0.512071, fit.radius_m.variance, 0.005182, fit.height_m.variance, 0.014129),
        ],
    )  # fmt: skip
    yield "(the paper's azimuth is from east and has the opposite sign; heights: positive is measured too high)"


def _row_3(name: str, *values: float) -> tuple[str, ...]:
    return (name, *(f"{value:.4f}" for value in values))


def _line(study: Study) -> Iterator[str]:
    radial, angular = study.cylindrical.radial_line, study.cylindrical.angular_line
    yield "Figure 12. Radial error over distance"
    yield from _rows(
        ("", "ours", "paper"),
        [
            ("slope", f"{radial.slope:.4e}", f"{published.RADIAL_SLOPE:.4e}"),
            ("offset, m", f"{radial.offset:.4e}", f"{published.RADIAL_OFFSET_M:.4e}"),
            ("r^2", f"{radial.r2:.3f}", f"{published.RADIAL_R2:.2f}"),
            ("r^2 of a line through the angle", f"{angular.r2:.3f}", f"< {published.ANGULAR_R2_MOST:.2f}, rejected"),
        ],
    )


def _table_4(study: Study) -> Iterator[str]:
    yield "Table 4. Mean and standard deviation of the error, m"
    rows = []
    for axis, name in enumerate(_AXES):
        for symbol, means in (("mu", True), ("sigma", False)):
            row = [f"{symbol} {name}"]
            for variant, records in study.records.items():
                quality = Quality.of(records)
                ours = (quality.mean_m if means else quality.sigma_m)[axis]
                theirs = (_MEANS_M if means else _SIGMAS_M).get(variant)
                row += [f"{ours:.4f}", "-" if theirs is None else f"{theirs[axis]:.4f}"]
            rows.append(tuple(row))
    yield from _rows(_head(study), rows)


def _table_5(study: Study) -> Iterator[str]:
    yield "Table 5. RMSE (Eq. 28) of the same samples, m; the paper's is not consistent with its Table 4"
    rows = []
    for axis, name in enumerate(_AXES):
        row = [name]
        for variant, records in study.records.items():
            theirs = _RMSE_M.get(variant)
            row += [f"{Quality.of(records).rmse_m[axis]:.4f}", "-" if theirs is None else f"{theirs[axis]:.4f}"]
        rows.append(tuple(row))
    yield from _rows(_head(study), rows)


def _head(study: Study) -> tuple[str, ...]:
    return ("", *(word for variant in study.records for word in (variant, "paper")))


def _extrinsic(study: Study) -> Iterator[str]:
    fits = {"": study.extrinsic}
    if study.by_autopilot is not None:
        fits = {"reference's attitude": study.extrinsic, "autopilot's attitude": study.by_autopilot}
    for name, fit in fits.items():
        yield (
            f"Extrinsic{name and f', {name}'}: {fit.frames} frames, corners off by {fit.rms_before_px:.2f} px before "
            f"and {fit.rms_px:.2f} px after"
        )
    columns = ("value", "sigma") if study.by_autopilot is None else ("reference", "sigma", "autopilot", "sigma")
    rows = [
        (
            name,
            *(f"{number:.4f}" for fit in fits.values() for number in (fit.values[index], fit.sigmas[index])),
            f"{PARAMETERS[index].prior_sigma:g}",
        )
        for index, name in enumerate(NAMES)
    ]
    yield from _rows(("", *columns, "prior sigma"), rows)
    for name, fit in fits.items():
        for warning in fit.warnings():
            yield f"warning{name and f', with the {name}'}: {warning}"


def _rows(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    widths = [max(len(row[column]) for row in (head, *rows)) for column in range(len(head))]
    for row in (head, *rows):
        first, *others = (
            cell.ljust(width) if not place else cell.rjust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        yield "  ".join((first, *others))
