import numpy as np

from alight.markers.layout import read_layout
from schemas.settings import Settings
from services.detector.detector import View
from services.detector.nested_aruco import MOST_OF_A_LEVEL
from services.detector.registry import detector_from
from services.detector.thinning import thinned
from station.bench.nested import scenes

NESTED = read_layout("nested")
SETTINGS = Settings.model_validate({"pad": {"layout": "nested"}, "detector": {"backend": "aruco"}})


def square(x, y, side):
    return np.array([[x, y], [x + side, y], [x + side, y + side], [x, y + side]], float)


def test_of_many_markers_the_largest_and_the_most_distant_stay():
    found = [
        (0, square(0, 0, 30)),
        (1, square(40, 0, 20)),
        (2, square(500, 0, 20)),
        (3, square(520, 0, 20)),
        (4, square(0, 400, 20)),
    ]
    assert {number for number, _ in thinned(found, 3)} == {0, 3, 4}
    assert thinned(found, 5) is found


def test_in_the_last_metre_small_markers_are_enough_and_farther_up_the_large_one():
    detector = detector_from(SETTINGS)
    for number, scene in enumerate(scenes(SETTINGS, 30)):
        found = detector.detect(View(scene.picture, (number + 1) * 10**10))
        ids = {marker.id for marker in found}
        assert len(ids) == len(found)
        if scene.height_m < 0.5:
            assert 68 not in ids
            assert 1 <= len(found) <= MOST_OF_A_LEVEL
        elif 1.6 < scene.height_m < 12.0:
            assert 68 in ids
    assert detector.counters()["whole_frame_searches"] >= 30
