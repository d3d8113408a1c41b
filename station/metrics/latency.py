"""From the light on the sensor to the setpoint: how long, and where the time went."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from schemas.message import Hop
from schemas.setpoint import Setpoint


class Stage(StrEnum):
    """What a datum waits for."""

    CAMERA = "camera"
    """From the middle of the exposure to the frame's publication."""
    TRANSPORT = "transport"
    """From one service's publication to the next one's reception."""
    QUEUE = "queue"
    """Received, but not yet taken up."""
    HANDLING = "handling"
    """From taking it up to publishing what came of it."""


@dataclass(frozen=True)
class Percentiles:
    """A distribution in three numbers."""

    mean_ms: float
    p50_ms: float
    p99_ms: float


@dataclass(frozen=True)
class StageTime:
    """One stage of one service; `transport` and `queue` are those on the way into it."""

    service: str
    stage: Stage
    time: Percentiles


@dataclass(frozen=True)
class LatencyBudget:
    """Capture to setpoint over all fresh setpoints."""

    setpoints: int
    total: Percentiles
    overhead: Percentiles
    """The total without the detector's own handling."""
    stages: tuple[StageTime, ...]
    """In the order in which a datum passes them; their means add up to the total's."""


def latency_budget(setpoints: Iterable[Setpoint]) -> LatencyBudget | None:
    """The budget of the fresh setpoints (each caused by a new estimate); None if there are none with hops."""
    fresh = [setpoint for setpoint in setpoints if setpoint.fresh and setpoint.hops]
    if not fresh:
        return None
    samples: dict[tuple[str, Stage], list[float]] = {}
    overheads_ms: list[float] = []
    for setpoint in fresh:
        stages = stage_times_ms(setpoint.captured_at_ns, setpoint.hops)
        for key, time_ms in stages.items():
            samples.setdefault(key, []).append(time_ms)
        overheads_ms.append(sum(stages.values()) - stages.get(("detector", Stage.HANDLING), 0.0))
    totals_ms = [(setpoint.hops[-1].published_at_ns - setpoint.captured_at_ns) / 1e6 for setpoint in fresh]
    return LatencyBudget(
        setpoints=len(fresh),
        total=percentiles(totals_ms),
        overhead=percentiles(overheads_ms),
        stages=tuple(
            StageTime(service, stage, percentiles(times_ms)) for (service, stage), times_ms in samples.items()
        ),
    )


def stage_times_ms(captured_at_ns: int, hops: Sequence[Hop]) -> dict[tuple[str, Stage], float]:
    """One datum's time in each stage, ms; between hosts a difference of clocks is in `transport`."""
    times: dict[tuple[str, Stage], float] = {}
    left_ns = captured_at_ns
    for number, hop in enumerate(hops):
        if number == 0:
            steps = {Stage.CAMERA: hop.published_at_ns - left_ns}
        else:
            steps = {
                Stage.TRANSPORT: hop.received_at_ns - left_ns,
                Stage.QUEUE: hop.handled_at_ns - hop.received_at_ns,
                Stage.HANDLING: hop.published_at_ns - hop.handled_at_ns,
            }
        for stage, time_ns in steps.items():
            times[(hop.service, stage)] = times.get((hop.service, stage), 0.0) + time_ns / 1e6
        left_ns = hop.published_at_ns
    return times


def percentiles(values: Sequence[float]) -> Percentiles:
    """Mean, median and 99th percentile (linear between the nearest ranks) of at least one value."""
    p50, p99 = np.percentile(values, (50, 99))
    return Percentiles(float(np.mean(values)), float(p50), float(p99))
