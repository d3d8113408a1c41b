"""The comparison as text."""

from collections.abc import Iterator, Sequence

import numpy as np

from station.experiment.consistency import Nees
from station.experiment.filter_comparison import FIXES, HEIGHTS_M, Comparison, Contestant
from station.experiment.filter_score import USABLE_S


def comparison_lines(result: Comparison) -> Iterator[str]:
    """Tables of accuracy, of consistency and of error by height."""
    yield f"{result.count} flights, {result.fixes} fixes, {result.outliers} refused as outliers by kalman; errors relative to the vehicle"
    yield ""
    yield "RMSE, cm, of the vector to the pad at capture time, and of what the commander steers by when it is out"
    head = (
        "",
        "last vector",
        "before touchdown",
        "all vectors",
        "steered by",
        "carried to",
        "and by its",
        "available",
        "age",
        "lag",
    )
    under = (
        "filter",
        "horizontal",
        "north east down",
        "horizontal",
        "horizontal",
        "touchdown",
        "drift",
        f"<= {USABLE_S:g} s, %",
        "ms",
        "ms",
    )
    yield from _table([head, under], [_row(one) for one in result.contestants.values() if one.flights])
    yield ""
    yield "Mean NEES (3 is honest; * outside the 95 % bounds), one claim a flight at each height above the pad"
    heights = ("", *(f"{height:g} m" for height in HEIGHTS_M), "last")
    yield from _table([heights], [_nees_row(one) for one in result.contestants.values() if one.flights])
    example = next((one.last_nees() for one in result.contestants.values() if one.last_nees()), None)
    if example is not None:
        low, high = example.bounds
        yield f"95 % bounds for {example.count} flights: {low:.2f} to {high:.2f}"
    yield ""
    yield "RMSE of the vector to the pad (three axes), cm, by height"
    yield from _table([heights], [_rmse_row(one) for one in result.contestants.values() if one.flights])


def horizontal_rmse_m(errors_m: np.ndarray) -> float | None:
    """Of errors (N, 2 or 3), metres; None of nothing."""
    return float(np.sqrt(np.mean(np.sum(errors_m[:, :2] ** 2, axis=1)))) if len(errors_m) else None


def _row(one: Contestant) -> tuple[str, ...]:
    last = one.last_errors_m()
    carried = np.array([flight.carried_m for flight in one.flights if flight.carried_m is not None]).reshape(-1, 2)
    errors = np.array([claim.error_m for claim in one.claims]).reshape(-1, 3)
    steered = np.array([c.steered_error_m for c in one.claims if c.steered_error_m is not None]).reshape(-1, 3)
    drifted = np.array([flight.drifted_m for flight in one.flights if flight.drifted_m is not None]).reshape(-1, 2)
    axes = " ".join(f"{100.0 * value:.2f}" for value in np.sqrt(np.mean(last**2, axis=0))) if len(last) else "-"
    available = [flight.available for flight in one.flights if flight.available is not None]
    ages_s = [flight.age_s for flight in one.flights if flight.age_s is not None]
    lag = None if one.name.startswith(FIXES) else one.lag_s()
    return (
        one.name,
        _centimetres(horizontal_rmse_m(last)),
        axes,
        _centimetres(horizontal_rmse_m(errors)),
        _centimetres(horizontal_rmse_m(steered)),
        _centimetres(horizontal_rmse_m(carried)),
        _centimetres(horizontal_rmse_m(drifted)),
        f"{100.0 * float(np.mean(available)):.1f}" if available else "-",
        f"{1e3 * float(np.mean(ages_s)):.0f}" if ages_s else "-",
        "-" if lag is None else f"{1e3 * lag:.1f}",
    )


def _nees_row(one: Contestant) -> tuple[str, ...]:
    return (one.name, *(_nees(one.nees_at(height)) for height in HEIGHTS_M), _nees(one.last_nees()))


def _nees(value: Nees | None) -> str:
    return "-" if value is None else f"{value.mean:.2f}{'' if value.within else '*'}"


def _rmse_row(one: Contestant) -> tuple[str, ...]:
    at_heights = (np.array([claim.error_m for claim in one.at_height(height)]) for height in HEIGHTS_M)
    return (one.name, *(_rmse(errors) for errors in (*at_heights, one.last_errors_m())))


def _rmse(errors_m: np.ndarray) -> str:
    return f"{100.0 * float(np.sqrt(np.mean(np.sum(errors_m**2, axis=1)))):.2f}" if len(errors_m) else "-"


def _centimetres(value_m: float | None) -> str:
    return "-" if value_m is None else f"{100.0 * value_m:.2f}"


def _table(heads: Sequence[Sequence[str]], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    widths = [max(len(row[column]) for row in (*heads, *rows)) for column in range(len(heads[0]))]
    for row in (*heads, tuple("-" * width for width in widths), *rows):
        first, *others = (f"{cell:{'<' if column == 0 else '>'}{widths[column]}}" for column, cell in enumerate(row))
        yield "  ".join((first, *others)).rstrip()
