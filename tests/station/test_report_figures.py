"""Figures for print: the fits are right, the files are vector files, the same each time."""

import re

import numpy as np
import pytest

from station.biases.line_fit import fitted_line
from station.report.figures.altitude_error import altitude_error
from station.report.figures.cartesian_error import cartesian_error
from station.report.figures.correction_densities import correction_densities
from station.report.figures.cylindrical_error import cylindrical_error
from station.report.figures.density import density
from station.report.figures.error_by_position import error_by_position
from station.report.figures.landings import LandingTrack, time_series, trajectories
from station.report.figures.published import AZIMUTH_BIAS_DEG, RADIAL_OFFSET_M, RADIAL_SLOPE
from station.report.figures.radial_fit import radial_fit
from station.report.figures.static_records import StaticRecord


def hovers(samples: int = 60) -> list[StaticRecord]:
    """The paper's 17 positions with the paper's biases and a little noise."""
    random = np.random.default_rng(4)
    places = [(0.0, 0.0)] + [(d * np.sqrt(2), np.radians(a)) for a in (45, 135, 225, 315) for d in (2, 3, 4, 5)]
    made = []
    for radius_m, azimuth_rad in places:
        true = np.array([radius_m * np.cos(azimuth_rad), radius_m * np.sin(azimuth_rad), -10.0])
        wrong_m = radius_m * (1 + RADIAL_SLOPE) + RADIAL_OFFSET_M * (radius_m > 0)
        wrong_rad = azimuth_rad + np.radians(AZIMUTH_BIAS_DEG)
        centre = np.array([wrong_m * np.cos(wrong_rad), wrong_m * np.sin(wrong_rad), -10.4884])
        noise = random.normal(0, 0.01, (samples, 3))
        made.append(StaticRecord(true, centre + noise, true + noise))
    return made


def test_cylindrical_errors_are_those_put_in():
    for record in hovers()[1:]:
        angle_rad, radius_m = record.cylindrical_error
        assert np.degrees(angle_rad.mean()) == pytest.approx(AZIMUTH_BIAS_DEG, abs=0.1)
        assert radius_m.mean() == pytest.approx(RADIAL_SLOPE * record.distance_m + RADIAL_OFFSET_M, abs=0.005)
    assert np.isnan(hovers()[0].cylindrical_error[0]).all()


def test_the_azimuth_does_not_jump_at_south():
    record = StaticRecord(np.array([-5.0, 0.01, -10]), np.array([[-5.0, -0.01, -10]]))
    assert abs(record.cylindrical_error[0][0]) < 0.01


def test_the_radial_line_is_the_one_put_in():
    records = hovers()[1:]
    line = fitted_line(
        np.array([record.distance_m for record in records]),
        np.array([record.cylindrical_error[1].mean() for record in records]),
    )
    assert line.slope == pytest.approx(RADIAL_SLOPE, abs=2e-3)
    assert line.offset == pytest.approx(RADIAL_OFFSET_M, abs=0.01)
    assert line.r2 > 0.95


def test_a_density_is_that_of_the_sample_and_bears_a_constant():
    where, height = density(np.random.default_rng(0).normal(3.0, 2.0, 5000))
    true = np.exp(-0.5 * ((where - 3.0) / 2.0) ** 2) / (2.0 * np.sqrt(2 * np.pi))
    np.testing.assert_allclose(height, true, atol=0.1 * true.max())
    assert np.isfinite(density(np.full(10, 1.0))[1]).all()


@pytest.mark.parametrize(
    ("draw", "name", "beside"),
    [
        (error_by_position, "figure_08_positions", ""),
        (cartesian_error, "figure_09_cartesian", "paper"),
        (altitude_error, "figure_10_altitude", "paper"),
        (cylindrical_error, "figure_11_cylindrical", "paper"),
        (radial_fit, "figure_12_radial", "paper"),
    ],
)
def test_each_figure_is_a_pair_of_vector_files(tmp_path, draw, name, beside):
    files = draw(hovers(), tmp_path)
    assert (files.svg, files.pdf) == (tmp_path / f"{name}.svg", tmp_path / f"{name}.pdf")
    check_vector(files)
    assert beside in files.svg.read_text()


def test_the_correction_has_a_row_a_method_and_the_papers_sigma_where_there_is_one(tmp_path):
    errors = np.concatenate([record.error_ned_m for record in hovers(20)])
    files = correction_densities({"raw": errors, "extrinsic": 0.1 * errors}, tmp_path)
    check_vector(files)
    text = files.svg.read_text()
    assert text.count("<!-- μ") == 6 and text.count("(paper") == 3


def test_the_same_data_are_the_same_bytes(tmp_path):
    first, again = (radial_fit(hovers(10), tmp_path / name) for name in ("one", "two"))
    assert first.svg.read_bytes() == again.svg.read_bytes()
    assert first.pdf.read_bytes() == again.pdf.read_bytes()


def test_landings_are_drawn_by_mode(tmp_path):
    t_s = np.linspace(0, 20, 50)
    ned_m = np.stack([10 - t_s / 2, 10 - t_s / 2, t_s - 20], axis=1)
    tracks = [LandingTrack(mode, t_s, ned_m, t_s, ned_m) for mode in ("raw", "raw", "corrected")]
    files = trajectories(tracks, tmp_path) + time_series(tracks, tmp_path)
    assert [file.svg.stem for file in files] == [
        "figure_14_trajectories_1", "figure_14_trajectories_2", "figure_15_north", "figure_15_east", "figure_15_height",
    ]  # fmt: skip
    for file in files:
        check_vector(file)


def check_vector(files):
    svg = files.svg.read_text()
    assert "<image" not in svg and not re.search(r'href="(?!#)', svg)
    assert files.pdf.read_bytes().startswith(b"%PDF-") and b"/Subtype /Image" not in files.pdf.read_bytes()
