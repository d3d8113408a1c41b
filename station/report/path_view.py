"""Plan view, plan view of the pad, side view."""

from functools import partial

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from station.metrics.pad_error import PadError
from station.metrics.summary import FlightSummary
from station.report.flight_path import FlightPaths, Path, within
from station.report.picture import Picture
from station.report.svg import PAGE, dots

_PAD_VIEW_M = 1.0


def path_picture(summary: FlightSummary, paths: FlightPaths, pad_side_m: float) -> Picture:
    """The three views, beside or below each other."""
    draw = partial(_draw, summary, paths, pad_side_m)
    return Picture("path", "Path of the vehicle from above, near the pad, and from the side", 4.3, 10.6, draw)


def _draw(summary: FlightSummary, paths: FlightPaths, pad_side_m: float, drawn: Figure, narrow: bool) -> None:
    if narrow:
        plan, pad, side = drawn.subplots(3, 1, height_ratios=(1.0, 1.0, 0.85))
    else:
        plan, pad, side = drawn.subplots(1, 3, width_ratios=(1.0, 1.0, 1.15))
    _plan(plan, paths, pad_side_m)
    _pad(pad, summary, paths, pad_side_m)
    _side(side, paths)
    handles: dict[str, Artist] = {}
    for axes in (plan, pad, side):
        handles |= {label: handle for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    drawn.legend(list(handles.values()), list(handles), loc="outside lower center", ncols=2 if narrow else 4)


def _plan(axes: Axes, paths: FlightPaths, pad_side_m: float) -> None:
    axes.set_title("From above")
    _draw_pad(axes, pad_side_m)
    _draw_path(axes, paths)
    path = _main_path(paths)
    if path:
        start_m = path.ned_m[0]
        axes.annotate("start", (start_m[1], start_m[0]), (0, 7), textcoords="offset points", ha="center", fontsize=9)
    axes.margins(0.12)
    axes.set_aspect("equal", adjustable="datalim")
    _label(axes, "east of the pad [m]", "north of the pad [m]")


def _pad(axes: Axes, summary: FlightSummary, paths: FlightPaths, pad_side_m: float) -> None:
    axes.set_title("Near the pad")
    _draw_pad(axes, pad_side_m)
    _draw_errors(axes, summary.errors.raw, PAGE.raw, "fix, uncorrected")
    _draw_errors(axes, summary.errors.corrected, PAGE.corrected, "fix, corrected")
    _draw_errors(axes, summary.errors.estimate, PAGE.estimate, "estimate")
    _draw_path(axes, paths)
    if summary.touchdown:
        north_m, east_m, _ = summary.touchdown.contact_ned_m
        axes.plot(
            east_m, north_m, "x", color=PAGE.setpoint, markersize=9, markeredgewidth=2.6, label="touchdown", zorder=6
        )
    reach_m = max(_PAD_VIEW_M, 1.2 * pad_side_m)
    axes.set_xlim(-reach_m, reach_m)
    axes.set_ylim(-reach_m, reach_m)
    axes.set_aspect("equal", anchor="N")
    _label(axes, "east of the pad [m]", "north of the pad [m]")


def _side(axes: Axes, paths: FlightPaths) -> None:
    axes.set_title("From the side")
    shown = within(paths.setpoints, paths.shown_s)
    if shown:
        dots(axes, shown.horizontal_m, shown.height_m, 1.8, PAGE.setpoint, "setpoint", alpha=1.0, zorder=5)
    for path, colour, name, width in _flown(paths):
        axes.plot(path.horizontal_m, path.height_m, color=colour, linewidth=width, label=name)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    _label(axes, "horizontal distance from the pad [m]", "height above the pad [m]")


def _flown(paths: FlightPaths) -> list[tuple[Path, str, str, float]]:
    begin_s, end_s = max(0.0, paths.shown_s[0]), paths.shown_s[1]
    named = ((paths.navigated, PAGE.navigated, "path as navigated", 1.2), (paths.true, PAGE.truth, "true path", 2.0))
    cut = [(within(path, (begin_s, end_s)), colour, name, width) for path, colour, name, width in named]
    return [entry for entry in cut if entry[0]]


def _main_path(paths: FlightPaths) -> Path:
    flown = _flown(paths)
    return flown[-1][0] if flown else paths.true


def _draw_path(axes: Axes, paths: FlightPaths) -> None:
    for path, colour, name, width in _flown(paths):
        axes.plot(path.ned_m[:, 1], path.ned_m[:, 0], color=colour, linewidth=width, label=name, zorder=4)


def _draw_pad(axes: Axes, side_m: float) -> None:
    corner = (-side_m / 2, -side_m / 2)
    axes.add_patch(
        Rectangle(corner, side_m, side_m, facecolor=PAGE.faint, edgecolor=PAGE.muted, alpha=0.7, label="pad", zorder=0)
    )
    axes.plot(0, 0, "+", color=PAGE.muted, markersize=9)


def _draw_errors(axes: Axes, errors: tuple[PadError, ...], colour: str, name: str) -> None:
    if errors:
        dots(axes, [error.ned_m[1] for error in errors], [error.ned_m[0] for error in errors], 3.2, colour, name)


def _label(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
