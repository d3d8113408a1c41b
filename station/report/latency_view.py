"""Where the time went between the light and the setpoint."""

from matplotlib.axes import Axes
from matplotlib.patches import Patch

from station.metrics.latency import LatencyBudget, Stage
from station.report.svg import INK, MUTED, SERVICE_COLOURS, figure, inline_svg

_OPACITY = {Stage.CAMERA: 0.95, Stage.HANDLING: 0.95, Stage.QUEUE: 0.55, Stage.TRANSPORT: 0.28}
_MEANING = {Stage.HANDLING: "at work", Stage.QUEUE: "waiting in the service", Stage.TRANSPORT: "on the way to it"}


def latency_view(budget: LatencyBudget) -> str:
    """One bar a service, each beginning where the one above ends, as SVG."""
    services = list(dict.fromkeys(stage.service for stage in budget.stages))
    with figure(11.0, 1.3 + 0.42 * len(services), "latency") as drawn:
        axes = drawn.subplots()
        left_ms = 0.0
        for row, service in enumerate(services):
            left_ms = _draw_service(axes, budget, service, row, left_ms)
        axes.set_yticks(range(len(services)), services)
        axes.set_ylim(len(services) - 0.4, -0.6)
        axes.set_xlim(0, max(1.22 * budget.total.mean_ms, 1e-3))
        axes.grid(visible=False, axis="y")
        axes.set_xlabel("mean time since the light hit the sensor [ms]")
        keys = [Patch(facecolor=INK, alpha=_OPACITY[stage], label=_MEANING[stage]) for stage in _MEANING]
        drawn.legend(handles=keys, loc="outside lower center", ncols=3)
        return inline_svg(drawn, "Latency from capture to setpoint by stage")


def _draw_service(axes: Axes, budget: LatencyBudget, service: str, row: int, left_ms: float) -> float:
    total_ms = 0.0
    for entry in (entry for entry in budget.stages if entry.service == service):
        colour, opacity = SERVICE_COLOURS.get(service, MUTED), _OPACITY[entry.stage]
        axes.barh(row, entry.time.mean_ms, left=left_ms, height=0.62, color=colour, alpha=opacity, linewidth=0)
        left_ms += entry.time.mean_ms
        total_ms += entry.time.mean_ms
    axes.annotate(
        f"{total_ms:.2f} ms", (left_ms, row), (6, 0), textcoords="offset points", va="center", fontsize=9, color=INK
    )
    return left_ms
