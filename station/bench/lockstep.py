"""Twenty lockstep flights in wind with the paper's errors and the matching correction: accuracy, and times real time."""

import statistics
import tempfile
from dataclasses import dataclass
from pathlib import Path

from alight.runtime.settings_file import load_settings
from station.bench.table import print_table
from station.director import FlightPlan
from station.flight_record import read_flight
from station.flight_settings import PRESETS
from station.lockstep_flight import fly_lockstep
from station.metrics.summary import summarise

SEEDS = range(20)
WIND = ("simulator.wind.north_mps=0.0", "simulator.wind.east_mps=3.0", "simulator.wind.gust_mps=0.5")
START = "simulator.airborne={north_m=10.0, east_m=10.0, down_m=-20.0}"


@dataclass(frozen=True)
class Flown:
    """One flight."""

    seed: int
    failure: str | None
    error_m: float | None
    landing_s: float | None
    times_real: float


def bench_lockstep() -> None:
    """Fly and print."""
    flights = [fly_once(seed) for seed in SEEDS]
    rows = [
        (
            str(flight.seed),
            flight.failure or "landed",
            "-" if flight.error_m is None else f"{100 * flight.error_m:.1f}",
            "-" if flight.landing_s is None else f"{flight.landing_s:.1f}",
            f"{flight.times_real:.1f}",
        )
        for flight in flights
    ]
    title = "Lockstep flights from NED (10, 10, -20) m, preset `paper`, glide, wind 3 m/s with gusts of 0.5 m/s"
    print_table(title, ("seed", "outcome", "true error, cm", "landing, s", "times real time"), rows)
    errors_cm = [100 * flight.error_m for flight in flights if flight.error_m is not None]
    landed = sum(flight.failure is None for flight in flights)
    print(f"landed {landed} of {len(flights)}; true error median {statistics.median(errors_cm):.1f} cm, ", end="")
    print(f"worst {max(errors_cm):.1f} cm; {min(flight.times_real for flight in flights):.1f} times real time at least")


def fly_once(seed: int) -> Flown:
    """One flight of the series."""
    with tempfile.TemporaryDirectory() as folder:
        assignments = [*WIND, START, f"seed={seed}", f"recorder.directory={folder}"]
        settings = load_settings(PRESETS / "paper.toml", {}, assignments)
        outcome = fly_lockstep(settings, FlightPlan(takeoff_to_ned_m=None))
        summary = summarise(read_flight(Path(folder) / settings.recorder.file_name))
    landing_s = summary.touchdown.after_s if summary.touchdown else None
    failure = outcome.failure or (None if summary.verdict.ok else summary.verdict.reason)
    return Flown(seed, failure, summary.verdict.error_m, landing_s, outcome.flown_s / outcome.took_s)
