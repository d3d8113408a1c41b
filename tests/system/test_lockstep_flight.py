"""Whole flights in one process on the virtual clock: they land, and they repeat to the byte."""

from pathlib import Path

import pytest

from alight.runtime.settings_file import load_settings
from station.director import FlightPlan
from station.flight_record import read_flight
from station.flight_settings import PRESETS
from station.lockstep_flight import fly_lockstep
from station.metrics.summary import FlightSummary, summarise

pytestmark = pytest.mark.system

AIRBORNE = "simulator.airborne={north_m=10.0, east_m=10.0, down_m=-20.0}"
WIND = "simulator.wind={east_mps=3.0, gust_mps=0.5}"


def fly(out: Path, preset: str, *assignments: str) -> FlightSummary:
    settings = load_settings(PRESETS / f"{preset}.toml", {}, [AIRBORNE, f"recorder.directory={out}", *assignments])
    outcome = fly_lockstep(settings, FlightPlan(takeoff_to_ned_m=None))
    assert outcome.failure is None
    return summarise(read_flight(out))


def test_a_flight_in_wind_with_the_papers_errors_lands_on_the_pad(tmp_path: Path) -> None:
    summary = fly(tmp_path, "paper", WIND, "seed=1")
    assert summary.verdict.ok
    assert summary.verdict.error_m is not None and summary.verdict.error_m <= 0.15


def test_the_same_seed_gives_the_same_recording_to_the_byte_and_another_one_does_not(tmp_path: Path) -> None:
    for name, seed in (("first", 3), ("again", 3), ("other", 4)):
        fly(tmp_path / name, "paper", WIND, f"seed={seed}")
    first, again, other = ((tmp_path / name / "flight.mcap").read_bytes() for name in ("first", "again", "other"))
    assert first == again
    assert first != other


def test_without_the_correction_the_papers_errors_show(tmp_path: Path) -> None:
    corrected = fly(tmp_path / "corrected", "paper", "seed=2")
    raw = fly(tmp_path / "raw", "paper-uncorrected", "seed=2")
    assert error_high_up_m(raw) > 3.0 * error_high_up_m(corrected)


def error_high_up_m(summary: FlightSummary) -> float:
    """Median horizontal error of the estimate above 8 m."""
    errors_m = sorted(error.horizontal_m for error in summary.errors.estimate if error.height_m > 8.0)
    return errors_m[len(errors_m) // 2]
