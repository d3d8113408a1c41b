"""The example in examples/foreign_detector sees what our own detector sees."""

import importlib.util
from pathlib import Path

import cv2
import numpy as np
import pytest

from alight.geometry.camera import PinholeCamera
from alight.geometry.rotation import R_from_quaternion
from schemas.calibration import CameraCalibration
from schemas.settings import Settings
from services.detector.conformance import CHECKS, drawn_pad
from services.detector.detector import FoundMarker, View
from services.detector.square_pose import located

EXAMPLE = Path(__file__).parents[2] / "examples" / "foreign_detector" / "marker.py"
CALIBRATION = CameraCalibration(
    at_ns=1, width_px=640, height_px=480, fx_px=293.0, fy_px=295.0, cx_px=318.0, cy_px=242.0,
    distortion=(-0.05, 0.01, 0.001, -0.001, 0.0),
)  # fmt: skip
PAD = {"family": "5x5_1000", "id": 68, "side_m": 1.0}


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("foreign_marker", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def lens(example):
    return example.Lens.of(CALIBRATION.model_dump(mode="json"))


@pytest.fixture
def build(example, lens):
    """The example as one of our own detectors would be built."""

    class Adapter:
        name = "foreign"
        finder = example.MarkerFinder(example.PadMarker(**PAD))

        def detect(self, view: View) -> tuple[FoundMarker, ...]:
            return tuple(
                FoundMarker(marker["family"], marker["id"], np.array(marker["corners_px"]), marker["corner_sigma_px"])
                for marker in self.finder.find(view.picture, lens)
            )

        def counters(self) -> dict[str, int]:
            return {}

    return lambda settings: Adapter()


@pytest.mark.parametrize("check", CHECKS)
def test_it_passes_the_suite_that_our_own_detectors_are_under(build, check):
    check(build)


@pytest.mark.parametrize("side_px", [18.0, 60.0, 200.0])
def test_corners_are_no_worse_than_it_says(example, lens, side_px):
    finder = example.MarkerFinder(example.PadMarker(**PAD))
    errors_px = []
    for seed, turn_rad in enumerate(np.linspace(0.0, 6.0, 16)):
        pad = drawn_pad(Settings(), side_px=side_px, turn_rad=float(turn_rad), seed=seed)
        (marker,) = finder.find(pad.picture, lens)
        errors_px.append(np.array(marker["corners_px"]) - pad.corners_px)
    assert np.sqrt(np.mean(np.square(errors_px))) <= example.CORNER_SIGMA_PX


def seen_corners_px(example, lens, seed: int) -> np.ndarray:
    """A marker seen from 2 to 12 m above, tilted by some degrees, with a tenth of a pixel of noise."""
    generator = np.random.default_rng(seed)
    facing = cv2.Rodrigues(np.array([np.pi, 0.0, 0.0]))[0]
    turn = cv2.Rodrigues(generator.uniform(-0.3, 0.3, 3))[0] @ facing
    place = np.array([*generator.uniform(-0.5, 0.5, 2), generator.uniform(2.0, 12.0)])
    pixels, _ = cv2.projectPoints(example.square_m(1.0) @ turn.T, np.zeros(3), place, lens.matrix, lens.distortion)
    return pixels.reshape(4, 2) + generator.normal(0.0, 0.1, (4, 2))


@pytest.mark.parametrize("seed", range(20))
def test_the_better_pose_and_its_covariance_are_those_of_our_own_detector(example, lens, seed):
    corners_px = seen_corners_px(example, lens, seed)
    found = FoundMarker(PAD["family"], PAD["id"], corners_px, example.CORNER_SIGMA_PX)
    ours = located(found, PAD["side_m"], PinholeCamera.from_calibration(CALIBRATION)).poses[0]
    theirs = example.marker_message(example.PadMarker(**PAD), corners_px, lens)["poses"][0]
    R_between = R_from_quaternion(theirs["q_camera_marker"]).T @ R_from_quaternion(ours.q_camera_marker)
    our_sigma, their_sigma = (
        np.sqrt(np.diag(np.reshape(covariance, (6, 6)))) for covariance in (ours.covariance, theirs["covariance"])
    )
    apart_m = np.subtract(theirs["position_camera_m"], ours.position_camera_m)
    # One minimises the error in pixels, the other on the undistorted plane: less apart than the noise by far.
    assert (np.abs(apart_m) < 0.2 * our_sigma[:3]).all()
    assert np.degrees(np.linalg.norm(cv2.Rodrigues(R_between)[0])) < 1.0
    assert their_sigma == pytest.approx(our_sigma, rel=0.1)  # ours leaves the lens's distortion out


@pytest.mark.parametrize("seed", range(20))
def test_there_are_two_different_poses_and_the_ambiguity_compares_them(example, lens, seed):
    marker = example.marker_message(example.PadMarker(**PAD), seen_corners_px(example, lens, seed), lens)
    better, other = marker["poses"]
    assert abs(np.dot(better["q_camera_marker"], other["q_camera_marker"])) < 0.9999
    errors_px = better["reprojection_error_px"], other["reprojection_error_px"]
    assert errors_px[0] <= errors_px[1]
    assert marker["ambiguity"] == pytest.approx(errors_px[0] / errors_px[1])


def test_corners_are_the_edges_of_the_print_and_the_first_pixel_has_its_centre_at_zero(example, lens):
    picture = np.full((480, 640), 255, np.uint8)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_1000)
    picture[200:270, 300:370] = cv2.aruco.generateImageMarker(dictionary, PAD["id"], 70)
    picture[50:120, 50:120] = cv2.aruco.generateImageMarker(dictionary, PAD["id"] + 1, 70)
    (marker,) = example.MarkerFinder(example.PadMarker(**PAD)).find(picture, lens)
    edges_px = [[299.5, 199.5], [369.5, 199.5], [369.5, 269.5], [299.5, 269.5]]
    assert np.array(marker["corners_px"]) == pytest.approx(np.array(edges_px), abs=0.05)


def test_a_marker_behind_the_camera_has_no_pose(example, lens):
    behind = example.pose_message(
        example.square_m(1.0), np.zeros(3), np.array([0.0, 0.0, -3.0]), np.zeros((4, 2)), lens
    )
    assert behind is None
