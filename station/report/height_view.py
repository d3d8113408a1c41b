"""Height, setpoints and distance to the pad over time, with the phases behind them."""

from matplotlib.axes import Axes

from schemas.mission import Phase
from station.metrics.summary import FlightSummary
from station.report.flight_path import FlightPaths, since_s, within
from station.report.svg import (
    BAD,
    CORRECTED,
    ESTIMATE,
    FAINT,
    INK,
    MUTED,
    NAVIGATED,
    SETPOINT,
    TRUTH,
    figure,
    inline_svg,
)  # fmt: skip

_PHASE_COLOURS = {
    Phase.ACQUIRE: NAVIGATED,
    Phase.DESCEND: ESTIMATE,
    Phase.TOUCHDOWN: CORRECTED,
    Phase.HOLD: SETPOINT,
    Phase.ABORTED: BAD,
    Phase.YIELDED: BAD,
    Phase.FAILED: BAD,
}
_NARROW = 0.055


def height_view(summary: FlightSummary, paths: FlightPaths) -> str:
    """Two plots over one time axis, as SVG."""
    with figure(11.0, 5.2, "height") as drawn:
        height, distance = drawn.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
        for axes in (height, distance):
            _shade_phases(axes, summary, paths, named=axes is height)
        shown = within(paths.setpoints, paths.shown_s)
        if shown:
            height.plot(shown.t_s, shown.height_m, ".", color=SETPOINT, markersize=3.5, label="setpoint")
        named = ((paths.navigated, NAVIGATED, "as navigated", 1.2), (paths.true, TRUTH, "truth", 2.0))
        for path, colour, name, width in named:
            cut = within(path, paths.shown_s)
            if cut:
                height.plot(cut.t_s, cut.height_m, color=colour, linewidth=width, label=name)
                distance.plot(cut.t_s, cut.horizontal_m, color=colour, linewidth=width, label=name)
        _mark_touchdown(height, summary, paths)
        height.set_ylabel("height above the pad [m]")
        distance.set_ylabel("horizontal [m]")
        distance.set_xlabel("time since the descent began [s]")
        height.set_xlim(*paths.shown_s)
        height.set_ylim(bottom=min(0.0, height.get_ylim()[0]))
        distance.set_ylim(bottom=0)
        if height.get_legend_handles_labels()[0]:
            height.legend(loc="upper right", markerscale=2)
        return inline_svg(drawn, "Height above the pad, setpoints and horizontal distance over time")


def _shade_phases(axes: Axes, summary: FlightSummary, paths: FlightPaths, *, named: bool) -> None:
    first_s, last_s = paths.shown_s
    for span in summary.phases:
        begin_s = max(first_s, since_s(span.began_at_ns, paths.origin_ns))
        last_one = span is summary.phases[-1]
        end_s = last_s if last_one else min(last_s, since_s(span.ended_at_ns, paths.origin_ns))
        if end_s <= begin_s:
            continue
        axes.axvspan(begin_s, end_s, color=_PHASE_COLOURS.get(span.phase, FAINT), alpha=0.13, linewidth=0)
        axes.axvline(begin_s, color=FAINT, linewidth=0.8)
        narrow = (end_s - begin_s) / (last_s - first_s) < _NARROW
        if named:
            axes.annotate(
                span.phase.value,
                ((begin_s + end_s) / 2, 1.0),
                (0, 4),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
                ha="left" if narrow else "center",
                rotation=30 if narrow else 0,
                fontsize=9,
                color=INK,
            )


def _mark_touchdown(axes: Axes, summary: FlightSummary, paths: FlightPaths) -> None:
    contact = summary.touchdown
    if contact is None:
        return
    t_s, height_m = since_s(contact.at_ns, paths.origin_ns), -contact.contact_ned_m[2]
    axes.plot(t_s, height_m, "x", color=INK, markersize=9, markeredgewidth=2)
    axes.annotate(
        "touchdown",
        (t_s, height_m),
        (-8, 24),
        textcoords="offset points",
        ha="right",
        fontsize=9,
        arrowprops={"arrowstyle": "-", "color": MUTED},
    )
