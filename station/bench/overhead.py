"""From the light on the sensor to the setpoint, measured by the stamps of one live flight with nothing else running.

Beside it, before and after the flight: what the same messages cost with nothing of ours in them, so that a slow hour of the host is
not taken for slow code, nor slow code for one.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from schemas import topics
from station.bench.bare_hop import bare_hop
from station.bench.table import print_table
from station.flight_record import read_flight
from station.metrics.latency import LatencyBudget, Percentiles, Stage, latency_budget

TARGET_P50_MS, TARGET_P99_MS = 2.5, 8.0
TARGET_HOP_MS = 0.4
"""What the target takes a bare hop for."""


def bench_overhead() -> None:
    """Fly once and print the budget by stage, and the overhead: the total without the detector's own time."""
    before = _bare_hop()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "flight"
        command = [sys.executable, "-m", "station", "fly", "--out", str(out)]
        flown = subprocess.run(command, capture_output=True, text=True, check=False)
        if flown.returncode != 0:
            print(f"no figures: the flight failed\n{flown.stdout}{flown.stderr}")
            return
        budget = latency_budget(read_flight(out / "flight.mcap").messages(topics.SETPOINT))
    if budget is None:
        print("no figures: the flight has no setpoint that a new estimate caused")
        return
    _print(budget, (before, _bare_hop()))


def _bare_hop() -> Percentiles | None:
    """None, with the reason said, where the host lets no such messages through: the flight's own figures count without."""
    try:
        return bare_hop()
    except RuntimeError as error:
        print(f"no bare hop beside the flight: {error}")
        return None


def _print(budget: LatencyBudget, hops: tuple[Percentiles | None, Percentiles | None]) -> None:
    rows = [_row(f"{stage.service} {stage.stage}", stage.time) for stage in budget.stages]
    rows += [_row("total", budget.total), _row("overhead = total - detector handling", budget.overhead)]
    title = f"Capture to setpoint over {budget.setpoints} setpoints of one live flight, ms"
    print_table(title, ("stage", "mean", "p50", "p99"), rows)
    p50, p99 = budget.overhead.p50_ms, budget.overhead.p99_ms
    print(
        f"overhead p50 {p50:.2f} ms (target <= {TARGET_P50_MS}: {'met' if p50 <= TARGET_P50_MS else 'MISSED'}), "
        f"p99 {p99:.2f} ms (target <= {TARGET_P99_MS}: {'met' if p99 <= TARGET_P99_MS else 'MISSED'})"
    )
    before, after = hops
    if before is None or after is None:
        return
    count = sum(stage.stage is Stage.TRANSPORT for stage in budget.stages)
    bare_ms = count * (before.p50_ms + after.p50_ms) / 2.0
    print(
        f"a bare hop, which finds its caches as it left them, took {before.p50_ms:.2f} ms before the flight and {after.p50_ms:.2f} ms after it: "
        f"{count} of them are {bare_ms / p50:.0%} of the overhead's p50 (the target counts on {TARGET_HOP_MS} ms each, {count * TARGET_HOP_MS / TARGET_P50_MS:.0%})"
    )


def _row(name: str, time: Percentiles) -> tuple[str, str, str, str]:
    return name, f"{time.mean_ms:.2f}", f"{time.p50_ms:.2f}", f"{time.p99_ms:.2f}"
