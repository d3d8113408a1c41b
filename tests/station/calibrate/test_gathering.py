"""Views from a live camera: a board that is carried about and held still now and then."""

import math

import cv2
import numpy as np
import pytest
from test_camera_calibration import CAMERA, SIZE, TRUE, views

from schemas.settings import Settings
from station.calibrate.board import FoundCorners
from station.calibrate.gathering import ENOUGH_VIEWS, Gathering
from station.calibrate.judge import complaints_after
from station.calibrate.looking import InputError, look_live
from station.calibrate.solve import solve
from station.calibrate.spiral import BOARD, PICTURES, spiral_pictures
from station.calibrate.views import View, choose_views


def blurred(view: View, blur_px: float) -> View:
    return View(view.name, view.corners, blur_px, view.description)


def test_it_says_enough_when_a_calibration_would_be_accepted():
    gathering = Gathering(SIZE)
    for each in views(80):
        gathering.take(each)
        gathering.take(each)
        if gathering.enough:
            break
    assert gathering.enough
    assert gathering.missing == ""
    used = choose_views(gathering.views).used
    assert ENOUGH_VIEWS <= len(used) < 60
    solution = solve(used, SIZE)
    assert list(complaints_after(solution)) == []
    assert (np.abs(solution.values - TRUE)[:4] < 5.0 * solution.sigmas[:4]).all()


def test_a_board_in_motion_is_not_kept():
    gathering = Gathering(SIZE)
    assert [gathering.take(each).why for each in views(10)] == ["moving"] * 10
    assert gathering.views == ()


def test_of_views_alike_the_sharpest_is_kept():
    gathering = Gathering(SIZE)
    (first,) = views(1)
    said = [gathering.take(blurred(first, blur_px)).why for blur_px in (1.4, 1.4, 1.3, 0.7, 0.7)]
    assert said == ["moving", "new", "like another", "sharper than another", "like another"]
    assert [each.blur_px for each in gathering.views] == [0.7]


def test_it_says_what_is_missing():
    gathering = Gathering(SIZE)
    assert gathering.missing == "show the board to the camera"
    for each in views(40, place=(0.0, 0.0)):
        gathering.take(each)
        gathering.take(each)
    assert "corners of the picture not covered" in gathering.missing
    assert not gathering.enough


def held_still(count: int = PICTURES):
    """The simulated flight, three pictures of each place, with a blurred one and one without a board between."""
    for name, picture in spiral_pictures(Settings(), count):
        yield name, picture
        yield name, picture
        yield f"{name} blurred", cv2.GaussianBlur(picture, (0, 0), 2.0)
        yield f"{name} nothing", np.full_like(picture, 120)


def test_live_pictures_are_looked_at_until_there_are_enough(tmp_path, capsys):
    file = tmp_path / "coverage.png"
    found, pictures, size_px = look_live(BOARD, held_still(), file)
    assert size_px == SIZE
    assert pictures < 4 * PICTURES, "it went on although it had enough"
    assert cv2.imread(str(file)).shape == (480, 640, 3)
    said = capsys.readouterr().out
    assert said.rstrip().endswith("enough")
    assert "views; hold the board elsewhere" in said or "not covered" in said
    assert all("nothing" not in each.name for each in found)
    solution = solve(choose_views(found).used, size_px)
    assert abs(solution.values[0] - CAMERA.fx_px) < 5.0 * solution.sigmas[0]
    assert solution.sigmas[0] < 0.01 * CAMERA.fx_px


def test_ctrl_c_ends_the_looking_and_not_the_calibration(tmp_path):
    def interrupted():
        yield from list(held_still(2))
        raise KeyboardInterrupt

    found, pictures, _ = look_live(BOARD, interrupted(), tmp_path / "coverage.png")
    assert (len(found), pictures) == (2, 8)


def test_pictures_of_two_sizes_are_refused(tmp_path):
    pictures = iter([("one", np.zeros((480, 640), np.uint8)), ("two", np.zeros((240, 320), np.uint8))])
    with pytest.raises(InputError, match="two has another size"):
        look_live(BOARD, pictures, tmp_path / "coverage.png")


def test_views_of_other_places_are_apart():
    """What counts as another view is the same here and where views are chosen."""
    one, other = views(2)
    shifted = View("", FoundCorners(one.corners.points_m, one.corners.pixels + 1.0), 0.6, one.description)
    gathering = Gathering(SIZE)
    assert [gathering.take(each).kept for each in (one, shifted, other, other)] == [False, True, False, True]
    assert math.isfinite(gathering.coverage().covered)
