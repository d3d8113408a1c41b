"""The shipped layout `nested` against what it was chosen for; its places were found by `python -m station.pad.nesting`."""

import math

import numpy as np
import pytest

from alight.geometry.camera import PinholeCamera
from alight.markers.family import marker_cells
from alight.markers.layout import read_layout
from alight.markers.visibility import Spread, worst_sight
from schemas.calibration import CameraCalibration
from schemas.settings import Settings
from schemas.settings.camera import Calibration
from schemas.settings.pad import PadSettings
from services.detector.detector import View
from services.detector.registry import detector_from
from station.bench.nested import look, scenes
from station.pad.nesting import LEAST_SIDE_PX, MOST_INK, as_toml, least_clearance, worst_ink

NESTED = read_layout("nested")
PAPER = read_layout("paper")
CAMERA = PinholeCamera.from_calibration(CameraCalibration(at_ns=0, **Calibration().model_dump()))


@pytest.mark.parametrize("height_m", np.geomspace(0.15, 4.0, 12).tolist())
def test_some_marker_is_whole_in_view_from_wherever_the_camera_may_be(height_m):
    sight = worst_sight(NESTED, CAMERA, height_m, Spread(0.06, 0.1, math.radians(6)))
    assert sight.side_px >= LEAST_SIDE_PX


def test_the_paper_s_pad_alone_is_out_of_view_in_the_last_metre():
    assert worst_sight(PAPER, CAMERA, 0.5, Spread()).side_px == 0.0
    assert worst_sight(PAPER, CAMERA, 3.0, Spread()).share_by_marker == (1.0,)


def test_small_markers_leave_the_large_one_s_code_readable():
    assert worst_ink(NESTED) <= MOST_INK
    assert least_clearance(NESTED) >= 0.1


def test_no_two_codes_are_easily_taken_for_each_other():
    codes = [marker_cells(marker.family, marker.id) for marker in NESTED.markers]
    for index, code in enumerate(codes):
        for other in codes[:index]:
            assert min(int((np.rot90(code, turns) != other).sum()) for turns in range(4)) >= 8


def test_the_layout_survives_being_written_and_read(tmp_path):
    file = tmp_path / "again.toml"
    file.write_text(as_toml(NESTED))
    assert read_layout(str(file)).markers == NESTED.markers


def test_the_pad_is_seen_and_located_at_every_height():
    settings = Settings(seed=5, pad=PadSettings(layout="nested"))
    detector = detector_from(settings)
    seen = [look(detector, scene, NESTED, CAMERA, number) for number, scene in enumerate(scenes(settings, 40))]
    below_18_m = [each for each in seen if each.height_m < 18.0]
    assert all(each.markers for each in below_18_m)
    assert sum(each.strangers for each in seen) == 0
    assert max(each.error for each in below_18_m) < 0.02


def test_the_large_marker_is_read_although_small_ones_lie_inside():
    settings = Settings(pad=PadSettings(layout="nested"))
    detector = detector_from(settings)
    between = [scene for scene in scenes(settings, 24) if 2.0 < scene.height_m < 8.0]
    found = [detector.detect(View(scene.picture, (1 + i) * 10**10, CAMERA)) for i, scene in enumerate(between)]
    assert all(68 in {marker.id for marker in markers} for markers in found)
