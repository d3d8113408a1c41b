import sys

import numpy as np
import pytest

from schemas.settings import Settings
from services.detector.conformance import CAMERA, FRAME_NS, drawn_pad
from services.detector.detector import View
from services.detector.registry import UnknownDetectorError, detector_from
from tests.services.detector.own_model import contrast_model


def yolo(**settings):
    return detector_from(Settings.model_validate({"detector": {"backend": "yolo", "yolo": settings}}))


def test_a_model_of_ones_own_finds_a_pad_that_aruco_cannot_read(tmp_path) -> None:
    """Nine pixels a side: a block of eight pixels on it differs from the ground."""
    detector = yolo(model=contrast_model(tmp_path / "m.onnx", box_px=9.0), least_score=0.05)
    aruco = detector_from(Settings.model_validate({"detector": {"backend": "aruco"}}))
    for number in range(5):
        pad = drawn_pad(Settings(), side_px=9.0, centre_px=(100.0 + 83.0 * number, 231.4), turn_rad=number, seed=number)
        view = View(pad.picture, 1 + number * 10**10, CAMERA)
        assert aruco.detect(view) == ()
        (found,) = detector.detect(view)
        assert np.abs(found.corners_px - pad.corners_px).max() < 0.5
    assert detector.counters()["model_runs"] == detector.counters()["found_by_pattern"] == 5


def test_a_box_that_may_mean_many_sizes_is_looked_at_in_all_of_them(tmp_path) -> None:
    file = contrast_model(tmp_path / "m.onnx", box_px=20.0)
    pad = drawn_pad(Settings(), side_px=9.0, turn_rad=0.5)
    view = View(pad.picture, 1, CAMERA)
    assert yolo(model=file, least_score=0.05, least_sides_a_box=1.0, most_sides_a_box=1.0).detect(view) == ()
    (found,) = yolo(model=file, least_score=0.05, least_sides_a_box=1.0, most_sides_a_box=3.0).detect(view)
    assert np.abs(found.corners_px - pad.corners_px).max() < 0.5


def test_a_proposal_is_no_detection(tmp_path) -> None:
    """The model sees something everywhere; in pictures of noise and plain squares there is no pad."""
    detector = yolo(model=contrast_model(tmp_path / "m.onnx", box_px=12.0, gain=50.0), most_boxes=20)
    random = np.random.default_rng(5)
    for number in range(4):
        picture = random.integers(60, 180, (480, 640)).astype(np.uint8)
        picture[200:212, 300:312] = 20 + 60 * number
        assert detector.detect(View(picture, 1 + number * 10**10, CAMERA)) == ()
    assert detector.counters()["places_proposed"] >= 40


def test_a_model_that_sees_nothing_loses_nothing_that_aruco_finds(tmp_path) -> None:
    detector = yolo(model=contrast_model(tmp_path / "m.onnx", gain=0.0))
    pad = drawn_pad(Settings(), side_px=60.0, turn_rad=0.3)
    (found,) = detector.detect(View(pad.picture, 1, CAMERA))
    assert np.abs(found.corners_px - pad.corners_px).max() < 0.1
    assert detector.counters()["found_by_pattern"] == 0


def test_once_found_the_pad_is_followed_without_the_model(tmp_path) -> None:
    detector = yolo(model=contrast_model(tmp_path / "m.onnx", box_px=9.0), least_score=0.05)
    for number in range(6):
        pad = drawn_pad(Settings(), side_px=9.0, centre_px=(300.0 + 2.0 * number, 200.0), seed=number)
        assert len(detector.detect(View(pad.picture, 1 + number * FRAME_NS, CAMERA))) == 1
    assert detector.counters()["model_runs"] == 1
    assert detector.counters()["tracked"] == 5


def test_without_the_extra_one_line_says_what_to_install(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    for module in ("model", "places"):
        monkeypatch.delitem(sys.modules, f"services.detector.yolo.{module}", raising=False)
    with pytest.raises(UnknownDetectorError, match=r"needs onnxruntime: pip install 'alight\[yolo\]'$"):
        yolo()
