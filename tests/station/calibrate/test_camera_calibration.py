"""Calibrating: cameras that are known, boards that are projected through them, and real pictures with their authors' results."""

import math
import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from alight.geometry.camera import PinholeCamera
from alight.geometry.rotation import R_x, R_y, R_z
from schemas.settings import Settings
from services.camera.calibration_file import (
    CalibrationError,
    calibration_text,
    configured_calibration,
    read_calibration,
    scaled_to,
)
from station.__main__ import main
from station.calibrate.board import BoardError, FoundCorners, board_from
from station.calibrate.command import as_calibration
from station.calibrate.coverage import Coverage
from station.calibrate.judge import complaints_after, complaints_before
from station.calibrate.solve import NAMES, solve
from station.calibrate.spiral import BOARD, spiral_pictures
from station.calibrate.views import View, choose_views, find_views

REAL = Path(os.environ.get("ALIGHT_REAL_DATA", Path(__file__).resolve().parents[3].parent / "shared" / "real"))
CAMERA = PinholeCamera.from_calibration(configured_calibration(Settings().camera))
TRUE = np.array([CAMERA.fx_px, CAMERA.fy_px, CAMERA.cx_px, CAMERA.cy_px, *CAMERA.distortion])
SIZE = (640, 480)
POINTS = np.array([[0.2 * x - 0.8, 0.2 * y - 0.5, 0.0] for y in range(6) for x in range(9)])


def view(number, random, max_tilt=0.8, sigma_px=0.1, place=None, blur_px=0.6):
    """A board wholly in view somewhere, tilted up to so much."""
    while True:
        turn = (
            R_z(random.uniform(-3, 3))
            @ R_x(random.uniform(-max_tilt, max_tilt))
            @ R_y(random.uniform(-max_tilt, max_tilt))
        )
        distance = random.uniform(1.5, 4.0)
        x, y = (random.uniform(-1, 1), random.uniform(-0.75, 0.75)) if place is None else place
        pixels = CAMERA.project(POINTS @ turn.T + (x * distance, y * distance, distance))
        if np.isfinite(pixels).all() and (pixels > 2).all() and (pixels < (637, 477)).all():
            break
    pixels = pixels + random.normal(0, sigma_px, pixels.shape)
    middle = pixels.mean(axis=0)
    outline = np.concatenate(
        (middle, pixels[-1] - pixels[0], pixels[8] - pixels[-9], pixels[0] + pixels[-1] - 2 * middle)
    )
    return View(f"view{number}", FoundCorners(POINTS, pixels), blur_px, outline / 800.0)


def views(count, seed=0, **more):
    random = np.random.default_rng(seed)
    return [view(number, random, **more) for number in range(count)]


def refusals(found):
    chosen = choose_views(found)
    coverage = Coverage(SIZE)
    coverage.add(chosen.used)
    before = list(complaints_before(max(len(found), 20), len(found), chosen, coverage))
    return before or list(complaints_after(solve(chosen.used, SIZE)))


def test_the_camera_is_recovered_within_the_stated_uncertainty():
    normalised = []
    for seed in range(5):
        solution = solve(views(16, seed), SIZE)
        normalised.append((solution.values - TRUE) / solution.sigmas)
        assert solution.held_out_rms_px == pytest.approx(0.1 * math.sqrt(2), rel=0.15)
    # The larger of two estimates is stated, and a jackknife of twelve folds scatters itself.
    spread = np.sqrt(np.mean(np.square(normalised)))
    assert 0.5 < spread < 1.3


def test_a_good_set_is_not_refused():
    assert refusals(views(30)) == []


def test_too_few_views_are_refused():
    assert any("too few: the board was found in 4 of 20" in each for each in refusals(views(4)))


def test_a_board_that_is_never_moved_is_refused():
    random = np.random.default_rng(1)
    first = view(0, random)
    shaken = [
        View(
            f"view{n}",
            FoundCorners(POINTS, first.corners.pixels + random.normal(0, 0.3, (54, 2))),
            0.6,
            first.description,
        )
        for n in range(20)
    ]
    assert any("too alike" in each for each in refusals(shaken))


def test_a_board_that_is_never_tilted_is_refused():
    assert any("no tilt" in each for each in refusals(views(30, max_tilt=0.03)))


def test_corners_of_the_picture_that_were_never_covered_are_named():
    in_the_middle = views(20, place=(0.0, 0.0))
    left = [each for each in views(60) if each.corners.pixels[:, 0].max() < 420]
    assert any("upper left, upper right, lower left, lower right" in each for each in refusals(in_the_middle))
    assert any("upper right, lower right" in each and "left" not in each for each in refusals(left))


def test_blurred_views_are_left_out_and_a_few_that_do_not_fit_too():
    found = views(24)
    found[3] = View("blurred", found[3].corners, 2.5, found[3].description)
    found[7] = View(
        "bent",
        FoundCorners(POINTS, found[7].corners.pixels + np.linspace(0, 9, 108).reshape(54, 2)),
        0.6,
        found[7].description,
    )
    chosen = choose_views(found)
    assert [each.name for each in chosen.blurred] == ["blurred"]
    solution = solve(chosen.used, SIZE)
    assert [each.name for each in solution.outliers] == ["bent"]
    assert np.abs(solution.values[:2] - TRUE[:2]).max() < 1.5


def test_a_blurred_picture_says_how_blurred_it_is():
    sharp = dict(spiral_pictures_once())
    name, picture = next(iter(sharp.items()))
    ((_, as_taken),) = find_views(BOARD, [(name, picture)])
    ((_, blurred),) = find_views(BOARD, [(name, cv2.GaussianBlur(picture, (0, 0), 1.5))])
    assert 0.4 < as_taken.blur_px < 1.0
    assert blurred.blur_px == pytest.approx(math.hypot(as_taken.blur_px, 1.5), rel=0.15)


def spiral_pictures_once():
    pictures = spiral_pictures(Settings())
    yield next(pictures)


def test_chessboard_corners_are_found_where_they_are():
    """Against the simulated camera's own projection; all detectors count pixels from the centre of the first one."""
    (_, picture) = next(iter(spiral_pictures(Settings())))
    corners = BOARD.find(picture)
    solved, turn, shift = cv2.solvePnP(corners.points_m, corners.pixels, CAMERA.matrix, CAMERA.distortion)
    again, _ = cv2.projectPoints(corners.points_m, turn, shift, CAMERA.matrix, CAMERA.distortion)
    assert solved
    assert np.sqrt(np.mean((again.reshape(-1, 2) - corners.pixels) ** 2)) < 0.08


@pytest.mark.parametrize(
    ("text", "size"),
    [("charuco:5x7:0.04:0.02:6x6_250", (440, 600)), ("gridboard:5x7:0.03:0.01:6x6_250", (420, 580))],
)
def test_a_part_of_a_board_with_markers_is_enough(text, size):
    board = board_from(text)
    # Two pixels a millimetre: every edge lies between two pixels.
    printed = board._board.generateImage(size, marginSize=20)
    whole, part = board.find(printed), board.find(np.ascontiguousarray(printed[:380]))
    assert len(part.points_m) < len(whole.points_m)
    homography, _ = cv2.findHomography(part.points_m[:, :2], part.pixels)
    mapped = cv2.perspectiveTransform(part.points_m[None, :, :2], homography)[0]
    assert np.abs(mapped - part.pixels).max() < 0.25


@pytest.mark.parametrize(
    "text",
    [
        "chess:9x6:0.2",
        "chessboard:9:0.2",
        "chessboard:9x6:-1",
        "charuco:5x7:0.02:0.04:6x6_250",
        "charuco:5x7:0.04:0.02:7x9",
    ],
)
def test_a_board_that_is_none_is_refused_with_the_remedy(text):
    with pytest.raises(BoardError) as refused:
        board_from(text)
    assert text in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_calibration_is_scaled_to_a_binned_picture_and_not_to_a_cut_one():
    calibration = configured_calibration(Settings().camera)
    half = PinholeCamera.from_calibration(scaled_to(calibration, 320, 240))
    ray = np.array([[0.3, -0.2]])
    np.testing.assert_allclose((half.pixels(ray) + 0.5) * 2 - 0.5, CAMERA.pixels(ray), atol=1e-9)
    with pytest.raises(CalibrationError, match="something was cut off"):
        scaled_to(calibration, 640, 360)


def test_what_is_written_is_what_services_read(tmp_path):
    file = tmp_path / "calibration.toml"
    solution = solve(views(12), SIZE)
    file.write_text(calibration_text(as_calibration(solution, 'a "board"'), ["made for a test"]))
    calibration = read_calibration(file, "test")
    assert (calibration.fx_px, calibration.distortion[4]) == (solution.values[0], solution.values[8])
    assert calibration.source == 'a "board"'


def test_the_command_refuses_a_bad_set_and_says_why(tmp_path, capsys):
    _, picture = next(iter(spiral_pictures(Settings())))
    for number in range(7):
        cv2.imwrite(str(tmp_path / f"{number}.png"), picture)
    out = tmp_path / "out"
    assert main(["calibrate", "camera", str(tmp_path), "--board", "chessboard:9x6:0.20", "--out", str(out)]) == 1
    assert "refused: too alike" in capsys.readouterr().err
    assert not (out / "calibration.toml").exists()
    assert (out / "coverage.png").exists()


@pytest.mark.skipif(not REAL.is_dir(), reason="no real pictures here (ALIGHT_REAL_DATA)")
@pytest.mark.parametrize(
    ("folder", "pattern", "board"),
    [
        ("bottomcam_chessboard_20190214_squeezed", "*.png", "chessboard:8x5:0.03"),
        ("tello_front_gridboard", "[0-9]*.png", "gridboard:5x7:0.033:0.0035:6x6_1000"),
    ],
)
def test_the_authors_of_real_sets_found_the_same_camera(folder, pattern, board):
    pictures = [
        (file.name, cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)) for file in sorted((REAL / folder).glob(pattern))
    ]
    found = [each for _, each in find_views(board_from(board), pictures) if each is not None]
    solution = solve(choose_views(found).used, (pictures[0][1].shape[1], pictures[0][1].shape[0]))
    matrix, distortion = np.load(REAL / folder / "mtx.npy"), np.load(REAL / folder / "dist.npy").ravel()
    authors = np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *distortion[:5]])
    off = dict(zip(NAMES, np.abs(solution.values - authors) / solution.sigmas, strict=True))
    assert max(off.values()) < 3.0, off


@pytest.mark.skipif(not REAL.is_dir(), reason="no real pictures here (ALIGHT_REAL_DATA)")
def test_a_real_set_that_leaves_half_of_the_picture_out_is_refused(tmp_path, capsys):
    folder = REAL / "bottomcam_chessboard_20181028"
    assert (
        main(["calibrate", "camera", str(folder), "--board", "chessboard:8x5:0.03", "--out", str(tmp_path / "out")])
        == 1
    )
    assert "not covered: upper right, lower right" in capsys.readouterr().err
