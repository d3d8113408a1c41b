"""The rows of a campaign as columns: what was measured, and what varied."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from station.campaign.row import MEASURED

Row = Mapping[str, object]
"""One flight: `index`, the factors by their keys, what was measured; None for what is unknown."""

INDEX, NAME, LANDED, OUTCOME, REASON, RECORDING = "index", "name", "landed", "outcome", "reason", "recording"
ERROR_M, NORTH_M, EAST_M = "touchdown_error_m", "touchdown_north_m", "touchdown_east_m"
MEASURES: Mapping[str, tuple[str, float]] = {
    "landing_s": ("time to land [s]", 1.0),
    "path_m": ("distance flown [m]", 1.0),
    "sink_rate_mps": ("sink rate at contact [m/s]", 1.0),
    "detection_rate": ("frames that show the pad [%]", 100.0),
    "estimate_rms_m": ("RMS error of the estimate [cm]", 100.0),
    "latency_p99_ms": ("capture to setpoint, p99 [ms]", 1.0),
}
"""Measured columns that have a distribution: what they are, and the factor to that unit."""
_NO_FACTORS = frozenset({INDEX, NAME, RECORDING, "seed", *MEASURED})
_FEW = 6

Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class Factor:
    """Something that varied."""

    key: str
    numbers: Numbers | None
    """(N,) values; None if they are names, or so few that they are treated as such."""
    levels: tuple[str, ...]
    """The different values as texts, in order; empty for numbers."""
    level_of: NDArray[np.int64]
    """(N,) index into the levels; empty for numbers."""


def numbers(rows: Sequence[Row], key: str) -> Numbers:
    """A column (N,); NaN for what is unknown."""
    return np.array([_number(row.get(key)) for row in rows], float)


def landed(rows: Sequence[Row]) -> NDArray[np.bool_]:
    """(N,), whether each flight landed on the pad."""
    return np.array([bool(row.get(LANDED)) for row in rows], bool)


def factors(rows: Sequence[Row]) -> tuple[Factor, ...]:
    """What varied over the flights; what explains the error at touchdown best comes first."""
    keys = list(dict.fromkeys(key for row in rows for key in row if key not in _NO_FACTORS))
    found = [_factor(rows, key) for key in keys]
    varied = [factor for factor in found if factor.numbers is not None or len(factor.levels) > 1]
    error_m = numbers(rows, ERROR_M)
    return tuple(sorted(varied, key=lambda factor: -strength(factor, error_m)))


def strength(factor: Factor, error_m: Numbers) -> float:
    """Share of the variance of the errors' ranks that the factor explains, 0 to 1: Spearman's rho squared, or eta squared."""
    known = np.isfinite(error_m)
    if factor.numbers is not None:
        known &= np.isfinite(factor.numbers)
    ranks = _ranks(error_m[known])
    if len(ranks) < 3 or not ranks.std():
        return 0.0
    if factor.numbers is not None:
        others = _ranks(factor.numbers[known])
        return float(np.corrcoef(ranks, others)[0, 1] ** 2) if others.std() else 0.0
    levels = factor.level_of[known]
    between = sum(
        (levels == level).sum() * (ranks[levels == level].mean() - ranks.mean()) ** 2 for level in set(levels)
    )
    return float(between / (len(ranks) * ranks.var()))


def recording_of(row: Row, out: Path) -> Path | None:
    """The recording of a flight, or its folder: what the row says, or the campaign's own folder; None if there is none."""
    if row.get(RECORDING):
        path = out / str(row[RECORDING])
        return path if path.exists() else None
    index = _number(row.get(INDEX))
    folder = out / "flights" / f"{int(index):06d}" if np.isfinite(index) else out
    return folder if (folder / "flight.mcap").is_file() else None


def text_of(value: object) -> str:
    """A value as people read it."""
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {text_of(part)}" for key, part in value.items())
    return value if isinstance(value, str) else json.dumps(value)


def _factor(rows: Sequence[Row], key: str) -> Factor:
    values = _without_constants([row.get(key) for row in rows])
    numeric = all(value is None or (isinstance(value, int | float) and not isinstance(value, bool)) for value in values)
    texts = [text_of(value) for value in values]
    if numeric:
        column = numbers(rows, key)
        different = np.unique(column[np.isfinite(column)])
        if len(different) > _FEW:
            return Factor(key, column, (), np.zeros(0, np.int64))
        levels = [text_of(value) for value in sorted({value for value in values if value is not None}, key=_number)]
        levels += ["null"] if None in values else []
    else:
        levels = sorted(set(texts))
    levels = list(dict.fromkeys(levels))
    return Factor(key, None, tuple(levels), np.array([levels.index(text) for text in texts], np.int64))


def _without_constants(values: Sequence[object]) -> Sequence[object]:
    """Of values that are tables only the keys in which they differ: the others say nothing."""
    tables = [value for value in values if isinstance(value, Mapping)]
    if len(tables) < len(values):
        return values
    keys = dict.fromkeys(key for table in tables for key in table)
    differing = [key for key in keys if len({text_of(table.get(key)) for table in tables}) > 1]
    return [{key: table.get(key) for key in differing} for table in tables]


def _ranks(values: Numbers) -> Numbers:
    """Ranks from 0; equal values share their mean rank."""
    _, inverse, counts = np.unique(values, return_inverse=True, return_counts=True)
    last = np.cumsum(counts) - 1
    return np.asarray(last - (counts - 1) / 2, float)[inverse]


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else np.nan
