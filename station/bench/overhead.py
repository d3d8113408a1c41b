"""From the light on the sensor to the setpoint, measured by the stamps of one live flight with nothing else running."""

import subprocess
import sys
import tempfile
from pathlib import Path

from schemas import topics
from station.bench.table import print_table
from station.flight_record import read_flight
from station.metrics.latency import LatencyBudget, Percentiles, latency_budget

TARGET_P50_MS, TARGET_P99_MS = 2.5, 8.0


def bench_overhead() -> None:
    """Fly once and print the budget by stage, and the overhead: the total without the detector's own time."""
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
    _print(budget)


def _print(budget: LatencyBudget) -> None:
    rows = [_row(f"{stage.service} {stage.stage}", stage.time) for stage in budget.stages]
    rows += [_row("total", budget.total), _row("overhead = total - detector handling", budget.overhead)]
    title = f"Capture to setpoint over {budget.setpoints} setpoints of one live flight, ms"
    print_table(title, ("stage", "mean", "p50", "p99"), rows)
    p50, p99 = budget.overhead.p50_ms, budget.overhead.p99_ms
    print(
        f"overhead p50 {p50:.2f} ms (target <= {TARGET_P50_MS}: {'met' if p50 <= TARGET_P50_MS else 'MISSED'}), "
        f"p99 {p99:.2f} ms (target <= {TARGET_P99_MS}: {'met' if p99 <= TARGET_P99_MS else 'MISSED'})"
    )


def _row(name: str, time: Percentiles) -> tuple[str, str, str, str]:
    return name, f"{time.mean_ms:.2f}", f"{time.p50_ms:.2f}", f"{time.p99_ms:.2f}"
