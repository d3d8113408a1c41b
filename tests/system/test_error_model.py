"""Hovers flown in lockstep through an installation with the paper's errors: the fits find them."""

import tomllib

import pytest

from services.geolocator.correction_file import read_correction
from station.__main__ import main
from station.experiment.hover_flights import fly_hovers
from station.experiment.hover_plan import HoverPlace

PLACES = [
    HoverPlace(0.0, 0.0),
    *(HoverPlace(distance, azimuth) for distance in (3.0, 6.0) for azimuth in (45.0, 225.0)),
]


@pytest.mark.system
def test_bias_is_calibrated_from_recordings(tmp_path, capsys):
    recordings = fly_hovers(PLACES, 20, 5, tmp_path / "flights", {}, ["simulator.sensors.yaw_bias_deg=0.0"])
    out = tmp_path / "bias"
    assert main(["calibrate", "bias", *map(str, recordings), "--out", str(out)]) == 0
    assert "Table 4" in capsys.readouterr().out
    extrinsic = read_correction(out / "correction.toml").extrinsic
    assert extrinsic.mount_yaw_deg == pytest.approx(-4.007, abs=1.0)
    assert extrinsic.pad_scale == pytest.approx(0.975, abs=0.01)
    cylindrical = read_correction(out / "correction_mean.toml")
    assert cylindrical.theta_deg == pytest.approx(4.0, abs=1.0)
    assert cylindrical.beta_d_m == pytest.approx(0.49, abs=0.03)
    fit = tomllib.loads((out / "correction.toml").read_text())["fit"]
    assert fit["after"]["rmse_m"][0] < fit["before"]["rmse_m"][0]
    assert len(list((out / "figures").glob("figure_*.svg"))) == 6
    assert "<h1>" in (out / "report.html").read_text()


@pytest.mark.system
def test_a_recording_that_shows_no_hover_is_refused_with_its_name(tmp_path, capsys):
    assert main(["calibrate", "bias", str(tmp_path / "nothing.mcap"), "--out", str(tmp_path)]) == 1
    assert "nothing.mcap" in capsys.readouterr().err
