"""Issue 4, Show 7: landings on the pad `nested` from NED (30, 20, -40) m with the detector of the settings, twenty seeds."""

import statistics
import tempfile
from dataclasses import dataclass
from pathlib import Path

from alight.runtime.clock import seconds
from alight.runtime.settings_file import load_settings
from schemas import topics
from schemas.fix import FixVerdict
from station.bench.table import print_table
from station.director import FlightPlan
from station.flight_record import FlightRecord, read_flight
from station.lockstep_flight import fly_lockstep
from station.metrics.summary import summarise

SEEDS = range(20)
FLIGHT = ("pad.layout=nested", "simulator.airborne={north_m=30.0, east_m=20.0, down_m=-40.0}")
SOON_S = 3.0
"""By then the pad has to be found."""


@dataclass(frozen=True)
class Flown:
    """One flight."""

    seed: int
    failure: str | None
    acquired_s: float | None
    """From the first picture to the first that gave an accepted fix."""
    holds: int
    """How often the descent stopped for want of estimates."""
    error_m: float | None
    """At the first contact, by the ground truth."""
    landing_s: float | None
    lowest_fix_m: float | None
    """Height of the vehicle above the pad when it was seen last before the contact."""


def bench_nested_landing() -> None:
    """Fly and print."""
    flights = [fly_once(seed) for seed in SEEDS]
    rows = [
        (
            str(flight.seed),
            flight.failure or "landed",
            _number(flight.acquired_s),
            str(flight.holds),
            _number(flight.error_m, 100.0),
            _number(flight.landing_s),
            _number(flight.lowest_fix_m, 1.0, 2),
        )
        for flight in flights
    ]
    title = "Landings on `nested` from NED (30, 20, -40) m, calm air"
    columns = ("seed", "outcome", "acquired, s", "holds", "true error, cm", "landing, s", "seen last at, m")
    print_table(title, columns, rows)
    soon = sum(flight.acquired_s is not None and flight.acquired_s <= SOON_S for flight in flights)
    landed = sum(flight.failure is None for flight in flights)
    print(f"acquired within {SOON_S:g} s {soon} of {len(flights)}; landed {landed} of {len(flights)}", end="")
    errors_cm = [100 * flight.error_m for flight in flights if flight.error_m is not None]
    if errors_cm:
        print(f"; true error median {statistics.median(errors_cm):.1f} cm, worst {max(errors_cm):.1f} cm", end="")
    print()


def fly_once(seed: int, assignments: tuple[str, ...] = ()) -> Flown:
    """One flight of the series; `assignments` (`section.key=value`) win."""
    with tempfile.TemporaryDirectory() as folder:
        settings = load_settings(None, {}, [*FLIGHT, f"seed={seed}", f"recorder.directory={folder}", *assignments])
        outcome = fly_lockstep(settings, FlightPlan(takeoff_to_ned_m=None))
        record = read_flight(Path(folder) / settings.recorder.file_name)
        summary = summarise(record)
    contact = summary.touchdown
    return Flown(
        seed=seed,
        failure=outcome.failure or (None if summary.verdict.ok else summary.verdict.reason),
        acquired_s=_acquired_s(record),
        holds=sum(span.code == "estimate_stale" for span in summary.phases),
        error_m=contact.error_m if contact else None,
        landing_s=contact.after_s if contact else None,
        lowest_fix_m=_lowest_fix_m(record, contact.at_ns) if contact else None,
    )


def _acquired_s(record: FlightRecord) -> float | None:
    frames, fixes = record.messages(topics.FRAME), record.messages(topics.PAD_FIX)
    accepted = [fix.captured_at_ns for fix in fixes if fix.verdict is FixVerdict.ACCEPTED]
    return seconds(min(accepted) - frames[0].captured_at_ns) if frames and accepted else None


def _lowest_fix_m(record: FlightRecord, contact_ns: int) -> float | None:
    seen = [
        fix.corrected.pad_ned_m[2]
        for fix in record.messages(topics.PAD_FIX)
        if fix.verdict is FixVerdict.ACCEPTED and fix.corrected is not None and fix.captured_at_ns <= contact_ns
    ]
    return seen[-1] if seen else None


def _number(value: float | None, scale: float = 1.0, digits: int = 1) -> str:
    return "-" if value is None else f"{scale * value:.{digits}f}"
