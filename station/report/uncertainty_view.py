"""How sure the fixes and estimates were, against how wrong they were."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from station.metrics.summary import FlightSummary
from station.metrics.uncertainty import NINETY_FIVE, Claim, Uncertainty, share_within
from station.report.flight_path import FlightPaths, since_s
from station.report.height_view import shade_phases
from station.report.picture import Picture
from station.report.svg import PAGE, dots

_LOWEST_CM = 0.1


def uncertainty_picture(summary: FlightSummary, paths: FlightPaths, claims: Uncertainty) -> Picture:
    """Error and claimed sigma over time, and their ratio."""
    title = "Horizontal error of fixes and estimates beside the uncertainty that they claimed"
    return Picture("uncertainty", title, 5.6, 6.4, partial(_draw, summary, paths, claims))


def uncertainty_words(claims: Uncertainty) -> str:
    """What the picture says, in a sentence."""
    against = "the truth" if claims.by_truth else "the place that all fixes agree on in hindsight (there is no truth)"
    parts = []
    for name, series in (("fixes", claims.fixes), ("estimates", claims.estimates)):
        share = share_within(series)
        if share is not None:
            parts.append(f"{share:.0%} of the {name}")
    lie = f"{' and '.join(parts)} lie" if parts else "Nothing lies"
    return f"Errors are against {against}. {lie} within what should hold 95 % (2.45 sigmas in the plane)."


def _draw(summary: FlightSummary, paths: FlightPaths, claims: Uncertainty, drawn: Figure, narrow: bool) -> None:
    error, ratio = drawn.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.0))
    for series, colour, name in (
        (claims.fixes, PAGE.corrected, "fix"),
        (claims.estimates, PAGE.estimate, "estimate"),
    ):
        if series:
            _series(error, ratio, series, paths, colour, name)
    error.set_yscale("log")
    error.set_ylabel("horizontal [cm]")
    _round_numbers(error)
    ratio.axhline(NINETY_FIVE, color=PAGE.ink, linewidth=0.9, linestyle="--", label="95 % of honest ones below")
    ratio.set_ylabel("error / sigma")
    ratio.set_ylim(0, max(1.25 * NINETY_FIVE, ratio.get_ylim()[1]))
    ratio.set_xlabel(paths.time_label)
    for axes in (error, ratio):
        axes.set_xlim(*paths.shown_s)
        shade_phases(axes, summary, paths, named=axes is error)
    handles, labels = error.get_legend_handles_labels()
    more, more_labels = ratio.get_legend_handles_labels()
    drawn.legend(handles + more, labels + more_labels, loc="outside lower center", ncols=2 if narrow else 5)


def _series(error: Axes, ratio: Axes, series: tuple[Claim, ...], paths: FlightPaths, colour: str, name: str) -> None:
    t_s = np.array([since_s(one.captured_at_ns, paths.origin_ns) for one in series])
    error_cm = np.maximum(_LOWEST_CM, [100 * one.error_m for one in series])
    dots(error, t_s, error_cm, 2.8, colour, f"{name}: error", alpha=0.5)
    error.plot(t_s, [100 * one.sigma_m for one in series], color=colour, linewidth=1.4, label=f"{name}: sigma")
    dots(ratio, t_s, [one.normalised for one in series], 2.8, colour, f"_{name}", alpha=0.5)


def _round_numbers(axes: Axes) -> None:
    low, high = axes.get_ylim()
    candidates = [base * 10.0**power for power in range(-2, 5) for base in (1, 2, 5)]
    shown = [value for value in candidates if low <= value <= high]
    if len(shown) > 6:
        shown = [value for value in shown if f"{value:e}"[0] == "1"]
    axes.set_yticks(shown, [f"{value:g}" for value in shown])
    axes.set_yticks([], minor=True)
