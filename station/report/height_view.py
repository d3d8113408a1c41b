"""Height, setpoints and distance to the pad over time, with the phases behind them."""

from functools import partial

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from schemas.mission import Phase
from station.metrics.summary import FlightSummary
from station.report.flight_path import FlightPaths, since_s, within
from station.report.picture import Picture
from station.report.svg import PAGE, dots

PHASE_COLOURS = {
    Phase.ACQUIRE: "navigated",
    Phase.DESCEND: "estimate",
    Phase.TOUCHDOWN: "corrected",
    Phase.LANDED: "good",
    Phase.HOLD: "setpoint",
    Phase.ABORTED: "bad",
    Phase.YIELDED: "bad",
    Phase.FAILED: "bad",
}
"""Colours of the palette by phase; the other phases are faint."""

_LETTER_IN = 0.085
_SIDES_IN = 0.9


def height_picture(summary: FlightSummary, paths: FlightPaths) -> Picture:
    """Two plots over one time axis."""
    title = "Height above the pad, setpoints and horizontal distance over time"
    return Picture("height", title, 4.9, 5.4, partial(_draw, summary, paths))


def shade_phases(axes: Axes, summary: FlightSummary, paths: FlightPaths, *, named: bool = False) -> None:
    """Colour the background by phase; with names above it where they have room."""
    first_s, last_s = paths.shown_s
    figure = axes.get_figure(root=True)
    room_in = (float(figure.get_figwidth()) if figure else 0.0) - _SIDES_IN
    free_from_s = first_s
    for span in summary.phases:
        begin_s = max(first_s, since_s(span.began_at_ns, paths.origin_ns))
        last_one = span is summary.phases[-1]
        end_s = last_s if last_one else min(last_s, since_s(span.ended_at_ns, paths.origin_ns))
        if end_s <= begin_s:
            continue
        colour = getattr(PAGE, PHASE_COLOURS.get(span.phase, "faint"))
        axes.axvspan(begin_s, end_s, color=colour, alpha=0.13, linewidth=0)
        axes.axvline(begin_s, color=PAGE.faint, linewidth=0.8)
        needed_s = _LETTER_IN * len(span.phase.value) / room_in * (last_s - first_s)
        if named and begin_s >= free_from_s and end_s - begin_s > needed_s:
            axes.annotate(
                span.phase.value, ((begin_s + end_s) / 2, 1.0), (0, 3), xycoords=("data", "axes fraction"),
                textcoords="offset points", ha="center", fontsize=9, color=PAGE.muted,
            )  # fmt: skip
            free_from_s = (begin_s + end_s + needed_s) / 2


def _draw(summary: FlightSummary, paths: FlightPaths, drawn: Figure, narrow: bool) -> None:  # noqa: ARG001
    height, distance = drawn.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
    shown = within(paths.setpoints, paths.shown_s)
    if shown:
        dots(height, shown.t_s, shown.height_m, 1.8, PAGE.setpoint, "setpoint", alpha=1.0, zorder=5)
    named = ((paths.navigated, PAGE.navigated, "as navigated", 1.2), (paths.true, PAGE.truth, "truth", 2.0))
    for path, colour, name, width in named:
        cut = within(path, paths.shown_s)
        if cut:
            height.plot(cut.t_s, cut.height_m, color=colour, linewidth=width, label=name)
            distance.plot(cut.t_s, cut.horizontal_m, color=colour, linewidth=width, label=name)
    for axes in (height, distance):
        axes.set_xlim(*paths.shown_s)
        shade_phases(axes, summary, paths, named=axes is height)
    _mark_touchdown(height, summary, paths)
    height.set_ylabel("height above the pad [m]")
    distance.set_ylabel("horizontal [m]")
    distance.set_xlabel(paths.time_label)
    height.set_ylim(bottom=min(0.0, height.get_ylim()[0]))
    distance.set_ylim(bottom=0)
    handles, labels = height.get_legend_handles_labels()
    if handles:
        drawn.legend(handles, labels, loc="outside lower center", ncols=3)


def _mark_touchdown(axes: Axes, summary: FlightSummary, paths: FlightPaths) -> None:
    contact = summary.touchdown
    if contact is None:
        return
    t_s, height_m = since_s(contact.at_ns, paths.origin_ns), -contact.contact_ned_m[2]
    axes.plot(t_s, height_m, "x", color=PAGE.ink, markersize=9, markeredgewidth=2)
    axes.annotate(
        "touchdown", (t_s, height_m), (4, 38), textcoords="offset points", ha="center", fontsize=9,
        arrowprops={"arrowstyle": "-", "color": PAGE.muted},
    )  # fmt: skip
