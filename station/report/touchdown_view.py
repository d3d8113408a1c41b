"""Where many flights touched down: distribution of the error, and the places."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke

from station.report.campaign_rows import EAST_M, ERROR_M, NORTH_M, Row, landed, numbers
from station.report.picture import Picture
from station.report.svg import PAGE, dots

_RINGS_CM = (1, 2, 5, 10, 20, 50, 100, 200, 500)
_CONFIDENCE = 0.05


def touchdown_picture(rows: Sequence[Row]) -> Picture | None:
    """Distribution function with its 95 % band, and the places where they are known; None if no flight touched down."""
    if not np.isfinite(numbers(rows, ERROR_M)).any():
        return None
    places = bool(np.isfinite(numbers(rows, NORTH_M)).any())
    title = "Horizontal error at touchdown: its distribution" + (" and the places" if places else "")
    return Picture("touchdown", title, 4.4 if places else 3.6, 7.6 if places else 3.6, partial(_draw, rows, places))


def _draw(rows: Sequence[Row], places: bool, drawn: Figure, narrow: bool) -> None:
    if not places:
        _distribution(drawn.subplots(), rows)
        drawn.legend(loc="outside lower center", ncols=1 if narrow else 2)
        return
    spread, place = (
        drawn.subplots(2, 1, height_ratios=(0.8, 1)) if narrow else drawn.subplots(1, 2, width_ratios=(1.3, 1))
    )
    _distribution(spread, rows)
    _places(place, rows)
    drawn.legend(loc="outside lower center", ncols=1 if narrow else 4)


def _distribution(axes: Axes, rows: Sequence[Row]) -> None:
    error_cm = np.sort(100 * numbers(rows, ERROR_M))
    error_cm = error_cm[np.isfinite(error_cm)]
    count = len(error_cm)
    share = 100 * np.arange(1, count + 1) / count
    half = 100 * np.sqrt(np.log(2 / _CONFIDENCE) / (2 * count))
    axes.fill_between(
        error_cm, np.maximum(0, share - half), np.minimum(100, share + half), step="post", color=PAGE.estimate,
        alpha=0.15, linewidth=0, label="95 % band (Dvoretzky, Kiefer, Wolfowitz)",
    )  # fmt: skip
    axes.step(error_cm, share, where="post", color=PAGE.estimate, label=f"{count} flights that touched down")
    for quantile, side in ((50, "median"), (95, "95 %")):
        value = float(np.percentile(error_cm, quantile))
        axes.plot([value, value, 0], [0, quantile, quantile], color=PAGE.muted, linewidth=0.9, linestyle="--")
        axes.annotate(f"{side}: {value:.1f} cm", (value, quantile), (6, -11), textcoords="offset points", fontsize=9)
    axes.set_title("Share of flights with a smaller error")
    axes.set_xlim(0, max(1.3 * error_cm[-1], 1e-3))
    axes.set_ylim(0, 102)
    axes.set_xlabel("horizontal error at touchdown [cm]")
    axes.set_ylabel("flights [%]")


def _places(axes: Axes, rows: Sequence[Row]) -> None:
    north_cm, east_cm = 100 * numbers(rows, NORTH_M), 100 * numbers(rows, EAST_M)
    good = landed(rows)
    distance_cm = np.hypot(north_cm, east_cm)
    size_pt = dot_size_pt(len(rows))
    reach_cm = 1.25 * max(float(np.nanpercentile(distance_cm, 99)), 2.0)
    for ring_cm in [ring for ring in _RINGS_CM if ring < 0.95 * reach_cm][-3:]:
        axes.add_patch(
            Circle((0, 0), ring_cm, fill=False, edgecolor=PAGE.muted, linewidth=0.9, linestyle=":", zorder=4)
        )
        axes.annotate(
            f"{ring_cm} cm", (0, ring_cm), (0, 2), textcoords="offset points", ha="center", fontsize=8, color=PAGE.ink,
            path_effects=[withStroke(linewidth=2.5, foreground=PAGE.card)],
        )  # fmt: skip
    dots(axes, east_cm[good], north_cm[good], size_pt, PAGE.estimate, "landed", alpha=0.6)
    if (~good & np.isfinite(north_cm)).any():
        dots(axes, east_cm[~good], north_cm[~good], size_pt, PAGE.bad, "not landed on the pad", alpha=0.8)
    axes.plot(0, 0, "+", color=PAGE.ink, markersize=9)
    axes.set_title("Where they touched down")
    axes.set_xlim(-reach_cm, reach_cm)
    axes.set_ylim(-reach_cm, reach_cm)
    axes.set_aspect("equal", anchor="N")
    axes.set_xlabel("east of the pad's centre [cm]")
    axes.set_ylabel("north [cm]")
    axes.grid(visible=False)


def dot_size_pt(flights: int) -> float:
    """Dots that are seen when there are few, and leave room when there are many."""
    return float(np.clip(40.0 / np.sqrt(flights), 2.6, 6.0))
