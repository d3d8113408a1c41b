"""Plan view, plan view of the pad, side view."""

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from station.metrics.pad_error import PadError
from station.metrics.summary import FlightSummary
from station.report.flight_path import FlightPaths, Path, within
from station.report.svg import CORRECTED, ESTIMATE, INK, MUTED, NAVIGATED, RAW, SETPOINT, TRUTH, figure, inline_svg

_PAD_VIEW_M = 1.0
_LOW_M = 5.0


def path_view(summary: FlightSummary, paths: FlightPaths, pad_side_m: float) -> str:
    """The three views in one SVG."""
    with figure(11.0, 4.5, "path") as drawn:
        plan, pad, side = drawn.subplots(1, 3, width_ratios=(1.0, 1.0, 1.25))
        _plan(plan, paths, pad_side_m)
        _pad(pad, summary, paths, pad_side_m)
        _side(side, paths)
        handles: dict[str, Artist] = {}
        for axes in (plan, pad, side):
            handles |= {label: handle for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
        drawn.legend(list(handles.values()), list(handles), loc="outside lower center", ncols=4, markerscale=1.6)
        return inline_svg(drawn, "Path of the vehicle from above, near the pad, and from the side")


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
    _draw_errors(axes, summary.errors.raw, RAW, "fix, uncorrected")
    _draw_errors(axes, summary.errors.corrected, CORRECTED, "fix, corrected")
    _draw_errors(axes, summary.errors.estimate, ESTIMATE, "estimate")
    _draw_path(axes, paths)
    if summary.touchdown:
        north_m, east_m, _ = summary.touchdown.contact_ned_m
        axes.plot(east_m, north_m, "x", color=INK, markersize=8, markeredgewidth=2.4, label="touchdown", zorder=5)
    reach_m = max(_PAD_VIEW_M, 1.2 * pad_side_m)
    axes.set_xlim(-reach_m, reach_m)
    axes.set_ylim(-reach_m, reach_m)
    axes.set_aspect("equal")
    _label(axes, "east of the pad [m]", "north of the pad [m]")


def _side(axes: Axes, paths: FlightPaths) -> None:
    axes.set_title("From the side")
    shown = within(paths.setpoints, paths.shown_s)
    if shown:
        axes.plot(shown.horizontal_m, shown.height_m, ".", color=SETPOINT, markersize=3, label="setpoint")
    for path, colour, name, width in _flown(paths):
        axes.plot(path.horizontal_m, path.height_m, color=colour, linewidth=width, label=name)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    _label(axes, "horizontal distance from the pad [m]", "height above the pad [m]")


def _flown(paths: FlightPaths) -> list[tuple[Path, str, str, float]]:
    begin_s, end_s = max(0.0, paths.shown_s[0]), paths.shown_s[1]
    named = ((paths.navigated, NAVIGATED, "path as navigated", 1.2), (paths.true, TRUTH, "true path", 2.2))
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
    axes.add_patch(Rectangle(corner, side_m, side_m, facecolor=MUTED, edgecolor=INK, alpha=0.25, label="pad"))
    axes.plot(0, 0, "+", color=MUTED, markersize=9)


def _draw_errors(axes: Axes, errors: tuple[PadError, ...], colour: str, name: str) -> None:
    if errors:
        east_m, north_m = [error.ned_m[1] for error in errors], [error.ned_m[0] for error in errors]
        size = [14 if error.height_m < _LOW_M else 5 for error in errors]
        axes.scatter(east_m, north_m, s=size, color=colour, alpha=0.55, linewidths=0, label=name)


def _label(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
