import sys

import numpy as np
import pytest

from alight.markers.family import FamilyError
from schemas.settings import Settings
from schemas.settings.detector import AprilTag
from services.detector.apriltag import LIBRARY_NAMES, AprilTagBackend
from services.detector.board_pose import pad_view
from services.detector.detector import View
from services.detector.registry import UnknownDetectorError, detector_from
from services.detector.square_pose import located

FAMILY = "apriltag_36h11"
TWO_FAMILIES = """
board_m = 1.3
[[marker]]
family = "apriltag_36h11"
id = 5
side_m = 0.5
x_m = -0.3
[[marker]]
family = "apriltag_25h9"
id = 3
side_m = 0.5
x_m = 0.3
rotation_rad = 1.5707963267948966
"""


@pytest.mark.parametrize("family", LIBRARY_NAMES)
@pytest.mark.parametrize("refine_edges", [True, False])
def test_on_rendered_frames_the_librarys_half_pixel_is_gone_and_the_corners_are_in_our_order(
    studio_with, family, refine_edges
) -> None:
    studio = studio_with(family=family, id=5)
    detector = AprilTagBackend([family], AprilTag(refine_edges=refine_edges))
    errors = []
    for height_m in (3.0, 5.0, 8.0):
        for number in range(6):
            shot = studio.shoot_at_random(height_m, number)
            errors += [
                marker.corners_px - shot.corners_px
                for marker in detector.detect(View(shot.picture, 1, studio.camera))
                if marker.id == 5
            ]
    assert len(errors) >= 12
    assert np.abs(np.mean(errors, axis=(0, 1))).max() < 0.03
    assert np.sqrt(np.mean(np.square(errors))) < 0.12


@pytest.mark.parametrize("height_m", [15.0, 6.0, 2.0])
def test_corners_are_found_where_they_are_within_what_the_detector_says_of_itself(studio_with, height_m) -> None:
    studio = studio_with(family=FAMILY, id=5)
    detector = AprilTagBackend([FAMILY], AprilTag())
    normalised = []
    for number in range(8):
        shot = studio.shoot_at_random(height_m, number)
        normalised += [
            np.mean((marker.corners_px - shot.corners_px) ** 2) / marker.corner_sigma_px**2
            for marker in detector.detect(View(shot.picture, 1, studio.camera))
        ]
    assert len(normalised) >= 6
    assert 0.1 < np.mean(normalised) < 2.5


def test_a_layout_of_two_families_gives_one_pose(studio_with, tmp_path) -> None:
    file = tmp_path / "two.toml"
    file.write_text(TWO_FAMILIES)
    studio = studio_with(layout=str(file))
    detector = detector_from(
        Settings.model_validate({"pad": {"layout": str(file)}, "detector": {"backend": "apriltag"}})
    )
    shot = studio.shoot(0.5, -0.4, -4.0, (0.1, 0.05, 0.6))
    markers = [located(found, 0.5, studio.camera) for found in detector.detect(View(shot.picture, 1, studio.camera))]
    pad = pad_view(markers, studio.layout, studio.camera)
    assert {(name.family, name.id) for name in pad.used} == {("apriltag_36h11", 5), ("apriltag_25h9", 3)}
    assert pad.left_out == ()
    assert np.abs(np.array(pad.poses[0].position_camera_m) - shot.centre_camera_m).max() < 0.02


def test_a_code_that_is_not_quite_a_markers_is_refused_and_counted(studio_with) -> None:
    shot = studio_with(family=FAMILY, id=5).shoot(0.0, 0.0, -5.0)
    strict = AprilTagBackend([FAMILY], AprilTag(least_margin=250.0))
    assert strict.detect(View(shot.picture, 1)) == ()
    assert strict.counters()["doubtful_codes_refused"] == 1


def test_small_families_do_not_read_markers_from_noise() -> None:
    """With 30 codes of 16 bits, one in some hundred squares reads as one of them."""
    detector = AprilTagBackend(["apriltag_16h5"], AprilTag())
    random = np.random.default_rng(1)
    for _ in range(10):
        noise = random.integers(0, 255, (480, 640)).astype(np.uint8)
        assert detector.detect(View(noise, 1)) == ()
    assert detector.counters()["doubtful_codes_refused"] > 0


def test_a_family_that_the_library_does_not_know_is_refused_with_the_remedy() -> None:
    with pytest.raises(FamilyError, match=r"reads apriltag_16h5, .* not 5x5_1000: take aided or aruco"):
        detector_from(Settings.model_validate({"detector": {"backend": "apriltag"}}))


def test_without_the_extra_one_line_says_what_to_install(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "pyapriltags", None)
    monkeypatch.delitem(sys.modules, "services.detector.apriltag")
    with pytest.raises(UnknownDetectorError, match=r"needs pyapriltags: pip install 'alight\[apriltag\]'$"):
        detector_from(Settings.model_validate({"detector": {"backend": "apriltag"}, "pad": {"family": FAMILY}}))
