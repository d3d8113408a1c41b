"""The file that a fit leaves is one that the geolocator takes, and says how it came about."""

import tomllib

import numpy as np
import pytest

from schemas.settings.geolocator import Correction, Extrinsic
from services.geolocator.correction_file import read_correction
from station.biases.artefact import artefact_text, write_artefact
from station.biases.quality import Quality
from station.report.figures.static_records import StaticRecord

BEFORE = Quality(np.array([0.0, 0.01, -0.48]), np.array([0.25, 0.24, 0.01]), np.array([0.25, 0.24, 0.481]))
AFTER = Quality(np.zeros(3), np.full(3, 0.03), np.full(3, 0.03))

CORRECTIONS = (
    Correction(method="cylindrical", theta_deg=4.19, alpha_r=0.0234, beta_r_m=0.014, beta_d_m=0.483),
    Correction(method="extrinsic", extrinsic=Extrinsic(mount_yaw_deg=-4.03, pad_scale=0.9759, image_latency_s=-0.007)),
)


@pytest.mark.parametrize("correction", CORRECTIONS, ids=lambda correction: correction.method)
def test_the_geolocator_reads_back_what_was_fitted(tmp_path, correction):
    path = tmp_path / "made" / "correction.toml"
    quality = {"before": BEFORE, "after": AFTER}
    text = artefact_text(correction, "one of them", "0123456789abcdef", {"radial_line_r2": 0.92}, quality, ['so "so"'])
    write_artefact(path, text)
    assert read_correction(path) == correction
    fit = tomllib.loads(path.read_text())["fit"]
    assert fit["method"] == "one of them"
    assert fit["data_sha256"] == "0123456789abcdef"
    assert "measured minus true" in fit["convention"]
    assert fit["warnings"] == ['so "so"']
    assert fit["before"]["sigma_m"] == [0.25, 0.24, 0.01]
    assert fit["after"]["rmse_m"] == [0.03, 0.03, 0.03]


def test_rmse_is_that_of_mean_and_sigma_together():
    random = np.random.default_rng(2)
    place = np.array([3.0, -2.0, -10.0])
    records = [StaticRecord(place, place + random.normal((0.2, 0.0, -0.5), 0.1, (50, 3))) for _ in range(4)]
    quality = Quality.of(records)
    np.testing.assert_allclose(quality.rmse_m**2, quality.mean_m**2 + quality.sigma_m**2, rtol=1e-12)
    assert quality.mean_m[2] == pytest.approx(-0.5, abs=0.03)
