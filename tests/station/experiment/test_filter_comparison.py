"""Comparing filters on recorded fixes: consistency, lag, availability, and the command."""

import argparse

import numpy as np
import pytest

from alight.runtime.settings_file import load_settings
from schemas import topics
from schemas.settings import Settings
from station.director import FlightPlan
from station.experiment.consistency import mean_bounds, nees
from station.experiment.descent import descent_settings
from station.experiment.filter_score import FlightTruth, estimate_score, fix_claims, lag_s
from station.experiment.filters_command import add_arguments, run
from station.experiment.refilter import filtered, recorded_fixes, relocated_fixes
from station.flight_record import read_flight
from station.lockstep_flight import fly_lockstep

LOW = "simulator.airborne={north_m=0.6, east_m=-0.4, down_m=-4.0}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A short descent with all faults, flown once."""
    out = tmp_path_factory.mktemp("descent") / "flight"
    chosen = descent_settings(20_000, {}, [LOW, f"recorder.directory={out}", 'recorder.frames="none"'])
    assert fly_lockstep(chosen, FlightPlan(takeoff_to_ned_m=None)).failure is None
    return out


@pytest.fixture(scope="module")
def record(folder):
    return read_flight(folder)


def flown_with(record):
    return Settings.model_validate(record.provenance.settings)


def test_bounds_are_those_of_chi_square():
    # Quantiles of chi-square with 600 and with 30 degrees of freedom, from tables: 534.02 and 669.77, 16.79 and 46.98.
    assert mean_bounds(200) == pytest.approx((534.02 / 200, 669.77 / 200), abs=2e-3)
    assert mean_bounds(10) == pytest.approx((16.79 / 10, 46.98 / 10), abs=5e-3)


def test_honest_claims_are_within_and_boasts_are_not():
    random = np.random.default_rng(5)
    errors = random.normal(0.0, 0.1, (200, 3))
    assert nees(errors, [0.01 * np.eye(3)] * 200).within
    assert not nees(errors, [0.005 * np.eye(3)] * 200).within
    assert not nees(errors, [0.02 * np.eye(3)] * 200).within
    assert nees([], []) is None


def test_filter_asked_again_gives_the_estimates_of_the_flight_to_the_last_bit(record):
    made = filtered(record, recorded_fixes(record), flown_with(record))
    recorded = {one.captured_at_ns: one for one in record.messages(topics.PAD_ESTIMATE)}
    assert len(recorded) > 20
    again = {one.message.captured_at_ns: one.message for one in made.estimates}
    assert again.keys() == recorded.keys()
    assert all(again[key].pad_ned_m == recorded[key].pad_ned_m for key in recorded)


def test_geolocator_asked_again_gives_the_fixes_of_the_flight_and_others_by_the_latest_pose(record):
    recorded = {fix.captured_at_ns: fix for fix in record.messages(topics.PAD_FIX)}
    again = relocated_fixes(record, flown_with(record), "capture")
    assert [one.message.raw for one in again] == [recorded[one.message.captured_at_ns].raw for one in again]
    truth = FlightTruth.of(record)
    kalman = filtered(record, again, flown_with(record))
    late = relocated_fixes(record, flown_with(record), "latest")
    on_time_s, late_s = (lag_s(fix_claims(truth, fixes, kalman.verdicts)) for fixes in (again, late))
    # The picture is 80 ms old when it leaves the camera, and the detector takes 8 ms.
    assert abs(on_time_s) < 0.03
    assert 0.05 < late_s - on_time_s < 0.12


def test_estimates_are_scored_until_the_touchdown(record):
    truth = FlightTruth.of(record)
    score = estimate_score(
        truth, filtered(record, recorded_fixes(record), flown_with(record)).estimates, recorded_fixes(record)
    )
    assert truth.touched_at_ns is not None
    assert all(claim.captured_at_ns <= truth.touched_at_ns for claim in score.claims)
    assert float(np.linalg.norm(score.claims[-1].error_m)) < 0.03
    assert 0.5 < score.available <= 1.0 and 0.08 < score.age_s < 0.5
    assert score.carried_m.shape == (2,)


def command(*words):
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    return run(parser.parse_args([str(word) for word in words]))


def test_command_prints_tables_and_draws(folder, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    assert command(folder, "--relocate", "--out", tmp_path, "--methods", "kalman,moving,median") == 0
    said = capsys.readouterr().out
    for name in ("fixes", "kalman", "moving", "median", "kalman, latest pose"):
        assert f"\n{name} " in said
    assert (tmp_path / "filters.svg").read_text().startswith("<?xml") and (tmp_path / "filters.pdf").exists()


def test_command_says_in_one_line_what_is_wrong(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    for words in ((), (tmp_path / "nothing",), (tmp_path, "--flights", "1")):
        assert command(*words, "--out", tmp_path) == 1
        assert capsys.readouterr().err.count("\n") == 1


def test_descents_differ_by_seed_and_repeat():
    one, again, other = (descent_settings(seed, {}) for seed in (1, 1, 2))
    assert one == again
    assert one.simulator.wind != other.simulator.wind and one.simulator.airborne != other.simulator.airborne
    assert load_settings(None, {}).filter.method == "kalman"
