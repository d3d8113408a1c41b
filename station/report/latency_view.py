"""Where the time went between the light and the setpoint."""

from functools import partial

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from station.metrics.latency import LatencyBudget, Stage
from station.report.picture import Picture
from station.report.svg import PAGE

_OPACITY = {Stage.CAMERA: 0.95, Stage.HANDLING: 0.95, Stage.QUEUE: 0.55, Stage.TRANSPORT: 0.28}
_MEANING = {Stage.HANDLING: "at work", Stage.QUEUE: "waiting in the service", Stage.TRANSPORT: "on the way to it"}


def latency_picture(budget: LatencyBudget) -> Picture:
    """One bar a service, each beginning where the one above ends."""
    services = list(dict.fromkeys(stage.service for stage in budget.stages))
    title, height_in = "Latency from capture to setpoint by stage", 1.3 + 0.4 * len(services)
    return Picture("latency", title, height_in, height_in + 0.4, partial(_draw, budget, services))


def _draw(budget: LatencyBudget, services: list[str], drawn: Figure, narrow: bool) -> None:
    axes = drawn.subplots()
    left_ms = 0.0
    for row, service in enumerate(services):
        left_ms = _draw_service(axes, budget, service, row, left_ms)
    axes.set_yticks(range(len(services)), services)
    axes.set_ylim(len(services) - 0.4, -0.6)
    axes.set_xlim(0, max((1.5 if narrow else 1.2) * budget.total.mean_ms, 1e-3))
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("mean time since the light hit the sensor [ms]")
    keys = [Patch(facecolor=PAGE.ink, alpha=_OPACITY[stage], label=_MEANING[stage]) for stage in _MEANING]
    drawn.legend(handles=keys, loc="outside lower center", ncols=1 if narrow else 3)


def _draw_service(axes: Axes, budget: LatencyBudget, service: str, row: int, left_ms: float) -> float:
    total_ms = 0.0
    for entry in (entry for entry in budget.stages if entry.service == service):
        colour, opacity = getattr(PAGE, service, PAGE.muted), _OPACITY[entry.stage]
        axes.barh(row, entry.time.mean_ms, left=left_ms, height=0.62, color=colour, alpha=opacity, linewidth=0)
        left_ms += entry.time.mean_ms
        total_ms += entry.time.mean_ms
    axes.annotate(
        f"{total_ms:.2f} ms",
        (left_ms, row),
        (6, 0),
        textcoords="offset points",
        va="center",
        fontsize=9,
        color=PAGE.ink,
    )
    return left_ms
