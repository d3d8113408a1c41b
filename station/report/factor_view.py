"""Error at touchdown by each thing that varied, and what else was measured."""

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from station.report.campaign_rows import (
    ERROR_M,
    MEASURES,
    Factor,
    Numbers,
    Row,
    factors,
    landed,
    numbers,
    strength,
)
from station.report.picture import Picture
from station.report.svg import PAGE, dots, ticks
from station.report.touchdown_view import dot_size_pt

MOST_PANELS = 12
_BINS = 8
_FEWEST_IN_BIN = 3
_PANEL_IN = 2.55
_LONGEST_LABEL = 22
_LONGEST_KEY = 38


def factor_picture(rows: Sequence[Row]) -> Picture | None:
    """One panel a factor, strongest first; None where nothing varied or nothing touched down."""
    shown = factors(rows)[:MOST_PANELS]
    if not shown or not np.isfinite(numbers(rows, ERROR_M)).any():
        return None
    title = "Error at touchdown by each factor"
    return Picture(
        "factors", title, _PANEL_IN * math.ceil(len(shown) / 3), _PANEL_IN * len(shown), partial(_factors, rows, shown)
    )


def measure_picture(rows: Sequence[Row]) -> Picture | None:
    """One histogram a measure; None where nothing was measured."""
    shown = [key for key in MEASURES if np.isfinite(numbers(rows, key)).any()]
    if not shown:
        return None
    title = "Distributions of what else was measured"
    return Picture(
        "measures", title, 2.1 * math.ceil(len(shown) / 3), 2.0 * len(shown), partial(_measures, rows, shown)
    )


def _grid(drawn: Figure, count: int, *, narrow: bool) -> list[Axes]:
    columns = 1 if narrow else min(3, count)
    made = drawn.subplots(math.ceil(count / columns), columns, squeeze=False).ravel().tolist()
    for spare in made[count:]:
        spare.set_axis_off()
    return list(made[:count])


def _factors(rows: Sequence[Row], shown: Sequence[Factor], drawn: Figure, narrow: bool) -> None:
    error_cm, good = 100 * numbers(rows, ERROR_M), landed(rows)
    top_cm = 1.15 * float(np.nanpercentile(error_cm, 99))
    for axes, factor in zip(_grid(drawn, len(shown), narrow=narrow), shown, strict=True):
        if factor.numbers is not None:
            _continuous(axes, factor.numbers, error_cm, good, top_cm)
        else:
            _levels(axes, factor, error_cm, good, top_cm)
        explained = strength(factor, error_cm)
        axes.set_title(
            f"explains {explained:.0%} of the error, by rank", fontsize=8.5, fontweight="normal", color=PAGE.muted
        )
        axes.set_xlabel(factor.key if len(factor.key) <= _LONGEST_KEY else f"…{factor.key[1 - _LONGEST_KEY :]}")
        axes.set_ylabel("error [cm]")
        axes.set_ylim(0, 1.12 * top_cm)


def _continuous(axes: Axes, values: Numbers, error_cm: Numbers, good: np.ndarray, top_cm: float) -> None:
    dots(axes, values, np.minimum(error_cm, top_cm), dot_size_pt(len(error_cm)), PAGE.estimate, "_flights", alpha=0.45)
    edges = np.quantile(values[np.isfinite(values)], np.linspace(0, 1, _BINS + 1))
    group = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, _BINS - 1)
    full = [n for n in range(_BINS) if (np.isfinite(error_cm) & (group == n)).sum() >= _FEWEST_IN_BIN]
    middles = [float(np.median(values[group == n])) for n in full]
    axes.plot(middles, [float(np.nanmedian(error_cm[group == n])) for n in full], color=PAGE.ink, linewidth=1.6)
    if (~good).any():
        ticks(axes, values[~good], 1.03 * top_cm, 1.1 * top_cm, PAGE.bad, "not landed")


def _levels(axes: Axes, factor: Factor, error_cm: Numbers, good: np.ndarray, top_cm: float) -> None:
    spread = np.random.default_rng(0).uniform(-0.28, 0.28, len(error_cm))
    dots(
        axes,
        factor.level_of + spread,
        np.minimum(error_cm, top_cm),
        dot_size_pt(len(error_cm)),
        PAGE.estimate,
        "_flights",
        alpha=0.45,
    )
    for level in range(len(factor.levels)):
        inside = factor.level_of == level
        if np.isfinite(error_cm[inside]).any():
            median_cm = float(np.nanmedian(error_cm[inside]))
            axes.plot([level - 0.36, level + 0.36], [median_cm] * 2, color=PAGE.ink, linewidth=2.0)
    if (~good).any():
        ticks(axes, (factor.level_of + spread)[~good], 1.03 * top_cm, 1.1 * top_cm, PAGE.bad, "not landed")
    room = max(6, _LONGEST_LABEL // len(factor.levels) + 3)
    axes.set_xticks(range(len(factor.levels)), [_shortened(level, room) for level in factor.levels])
    axes.set_xlim(-0.6, len(factor.levels) - 0.4)
    axes.grid(visible=False, axis="x")


def _measures(rows: Sequence[Row], shown: Sequence[str], drawn: Figure, narrow: bool) -> None:
    for axes, key in zip(_grid(drawn, len(shown), narrow=narrow), shown, strict=True):
        label, scale = MEASURES[key]
        values = scale * numbers(rows, key)
        values = values[np.isfinite(values)]
        axes.hist(values, bins=min(30, max(5, int(np.sqrt(len(values))) * 2)), color=PAGE.estimate, alpha=0.8)
        median = float(np.median(values))
        axes.axvline(median, color=PAGE.ink, linewidth=1.2, linestyle="--")
        axes.set_title(
            f"median {median:.3g}, most {values.max():.3g}", fontsize=8.5, fontweight="normal", color=PAGE.muted
        )
        axes.set_xlabel(label)
        axes.set_ylabel("flights")
        axes.locator_params(axis="both", nbins=5)


def _shortened(text: str, room: int) -> str:
    return text if len(text) <= room else f"{text[: room - 1]}…"
