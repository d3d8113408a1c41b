"""The paper's Tables 6 and 7: both altitude laws, with and without the corrections, from NED (10, 10, -20) m."""

import argparse
import math
import statistics
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from alight.runtime.settings_file import load_settings
from schemas.settings.simulator import SensorErrors
from station.bench.table import print_table
from station.director import FlightPlan
from station.flight_record import read_flight
from station.flight_settings import PRESETS
from station.lockstep_flight import fly_lockstep
from station.metrics.paper import PaperMetrics
from station.metrics.summary import summarise

FLIGHTS = 5
METRES_A_DEGREE = 111_132.0
"""Of latitude, on the average."""
START = "simulator.airborne={north_m=10.0, east_m=10.0, down_m=-20.0}"
WINDOW = ("filter.window_length=10", "filter.rate_hz=1.0")
"""Algorithm 1: at least ten entries, one release a second."""


@dataclass(frozen=True)
class Mode:
    """One row of the tables."""

    name: str
    preset: str
    assignments: tuple[str, ...]
    published: dict[str, tuple[float, float, float]]
    """By law: distance flown in metres, time in seconds, RMSE of the last ten positions in 1e-7 degrees (NOTES on Tables 6 and 7)."""


MODES = (
    Mode(
        "no correction",
        "paper-uncorrected.toml",
        ("filter.method=none",),
        {"exponential": (131.25, 143.77, 1.650), "linear": (205.88, 136.37, 1.74)},
    ),
    Mode(
        "bias",
        "paper.toml",
        ("filter.method=none",),
        {"exponential": (57.07, 44.30, 1.011), "linear": (192.15, 131.62, 2.38)},
    ),
    Mode(
        "bias, mean window",
        "paper.toml",
        ("filter.method=mean", *WINDOW),
        {"exponential": (37.44, 44.64, 0.875), "linear": (54.73, 116.09, 1.17)},
    ),
    Mode(
        "bias, median window",
        "paper.toml",
        ("filter.method=median", *WINDOW),
        {"exponential": (37.91, 43.62, 1.119), "linear": (67.25, 131.07, 2.68)},
    ),
)
LAWS = ("exponential", "linear")


@dataclass(frozen=True)
class Flown:
    """One flight."""

    measured: PaperMetrics | None
    landed: bool
    error_m: float | None
    """At rest or first contact, by the ground truth."""


def bench_paper_tables(words: Sequence[str] = ()) -> None:
    """Fly and print."""
    parser = argparse.ArgumentParser(prog="python -m station.bench paper-tables", description=__doc__)
    parser.add_argument(
        "--flights", type=int, default=FLIGHTS, metavar="N", help="for each law and mode (default %(default)s)"
    )
    count = parser.parse_args(words).flights
    rows = []
    for law in LAWS:
        for mode in MODES:
            rows.append(_row(law, mode, [fly_once(law, mode, seed) for seed in range(count)]))
            print(f"flown      {law}, {mode.name}", flush=True)
    title = (
        f"Guidance `reposition` beside the paper's Tables 6 and 7: means of {count} flights, in brackets as published"
    )
    columns = (
        "law",
        "correction",
        "landed",
        "distance, m",
        "time, s",
        "RMSE of the last ten, 1e-7 deg",
        "true error, cm",
    )
    print_table(title, columns, rows)
    print(
        "time and distance: from the first sample below 99.8 % of the start height until the height at rest; of flights that landed\n"
        "RMSE: of where the autopilot believed to be, so the wander of its position is in it (simulator.sensors.position_wander_m, "
        f"here {SensorErrors().position_wander_m} m along each axis: {_wander_1e7_deg():.1f}); the true error is without it"
    )


def fly_once(law: str, mode: Mode, seed: int) -> Flown:
    """One flight of the series, in calm air."""
    with tempfile.TemporaryDirectory() as folder:
        settings = load_settings(
            PRESETS / mode.preset,
            {},
            [
                "commander.guidance=reposition",
                f"commander.reposition.law={law}",
                *mode.assignments,
                START,
                f"seed={seed}",
                f"recorder.directory={folder}",
                "recorder.frames=none",
            ],
        )
        outcome = fly_lockstep(settings, FlightPlan(takeoff_to_ned_m=None))
        summary = summarise(read_flight(Path(folder) / settings.recorder.file_name))
    landed = outcome.failure is None and summary.landing is not None and summary.landing.landed
    return Flown(summary.paper, landed, summary.verdict.error_m)


def _row(law: str, mode: Mode, flights: list[Flown]) -> tuple[str, ...]:
    landed = [flight for flight in flights if flight.landed]
    measured = [flight.measured for flight in landed if flight.measured is not None]
    distance, time_s, rmse = mode.published[law]
    errors_cm = [100.0 * flight.error_m for flight in landed if flight.error_m is not None]
    return (
        law,
        mode.name,
        f"{len(landed)} of {len(flights)}",
        f"{_mean(measured, lambda each: each.distance_m)} ({distance:.1f})",
        f"{_mean(measured, lambda each: each.time_s)} ({time_s:.1f})",
        f"{_mean(measured, lambda each: each.rmse_1e7_deg, 2)} ({rmse:.2f})",
        f"{statistics.mean(errors_cm):.1f}" if errors_cm else "-",
    )


def _wander_1e7_deg() -> float:
    """What the default wander alone makes of the RMSE, 1e-7 degrees of latitude."""
    return math.sqrt(2.0) * SensorErrors().position_wander_m / METRES_A_DEGREE * 1e7


def _mean(measured: list[PaperMetrics], of: Callable[[PaperMetrics], float | None], digits: int = 1) -> str:
    values = [value for value in map(of, measured) if value is not None]
    return f"{statistics.mean(values):.{digits}f}" if values else "-"
