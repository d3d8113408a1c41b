"""The rendered picture against an independent one: every pixel as the mean of 8 x 8 exact rays through the blurred lens."""

import cv2
import numpy as np
import pytest

from alight.geometry.camera import PinholeCamera
from alight.markers.family import marker_cells
from alight.markers.layout import PlacedMarker
from alight.runtime.seed import generator
from schemas.settings import Settings
from schemas.settings.camera import Optics
from services.camera.calibration_file import configured_calibration
from services.camera.ground import MEAN_LEVEL
from services.camera.pad_print import PadPrint
from services.camera.renderer import Renderer
from services.camera.sensor import PIXEL_VARIANCE_PX2, Sensor, blur_kernel
from services.camera.simulated_camera import SimulatedCamera, exposure_instants_s
from services.camera.viewpoint import Viewpoint, mount_rotation

BLACK, WHITE, GROUND = 28.0, 218.0, float(MEAN_LEVEL)
SIDE_M, BOARD_M = 1.0, 1.3
SAMPLES = 8
LENS_BLUR_PX = 0.6
STILL = {"camera": {"simulated": {"optics": {"noise_level": 0.0, "exposure_s": 0.0}}}}


@pytest.fixture(scope="module")
def camera() -> PinholeCamera:
    return PinholeCamera.from_calibration(configured_calibration(Settings().camera))


@pytest.fixture(scope="module")
def renderer(camera) -> Renderer:
    pad = PadPrint((PlacedMarker("5x5_1000", 68, SIDE_M),), board_m=BOARD_M, black_level=BLACK, white_level=WHITE)
    return Renderer(camera, pad, None)


def reference(camera: PinholeCamera, viewpoint: Viewpoint, left: int, top: int, right: int, bottom: int) -> np.ndarray:
    fine = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    x = (np.arange(left, right)[:, None] + fine).ravel()
    y = (np.arange(top, bottom)[:, None] + fine).ravel()
    pixels = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    rays = np.column_stack((camera.undistorted(pixels), np.ones(len(pixels)))) @ viewpoint.R_marker_camera.T
    origin = np.array(viewpoint.position_marker_m)
    ground_m = (origin - rays * (origin[2] / rays[:, 2:]))[:, :2]
    cells = marker_cells("5x5_1000", 68)
    column = np.floor((ground_m[:, 0] / SIDE_M + 0.5) * 7).astype(int)
    row = np.floor((0.5 - ground_m[:, 1] / SIDE_M) * 7).astype(int)
    on_marker = (column >= 0) & (column < 7) & (row >= 0) & (row < 7)
    light = np.where((np.abs(ground_m) <= BOARD_M / 2).all(axis=1), WHITE, GROUND)
    light[on_marker] = np.where(cells[row[on_marker], column[on_marker]] == 1, WHITE, BLACK)
    picture = light.reshape((bottom - top) * SAMPLES, (right - left) * SAMPLES).astype(np.float32)
    blurred = cv2.GaussianBlur(picture, (0, 0), LENS_BLUR_PX * SAMPLES)
    return blurred.reshape(bottom - top, SAMPLES, right - left, SAMPLES).mean(axis=(1, 3))


@pytest.mark.parametrize("height_m", [24.0, 12.0, 4.0])
def test_the_pad_has_the_brightness_of_its_area(truth_at, camera, renderer, height_m) -> None:
    truth = truth_at(0.1 * height_m, -0.08 * height_m, -height_m, (0.08, -0.06, 0.9), pad_azimuth_rad=0.4)
    viewpoint = Viewpoint.from_truth(truth, np.eye(3))
    corners = np.array([[x, y, 0.0] for x in (-0.65, 0.65) for y in (-0.65, 0.65)])
    seen_at = camera.project(viewpoint.in_camera(corners))
    left, top = np.maximum(np.floor(seen_at.min(axis=0)).astype(int) - 6, 0)
    right, bottom = np.minimum(np.ceil(seen_at.max(axis=0)).astype(int) + 6, (640, 480))
    expected = reference(camera, viewpoint, left, top, right, bottom)[3:-3, 3:-3]

    scene = renderer.render(viewpoint)
    sensor = Sensor(camera, Optics(noise_level=0.0), generator(0, "test"))
    seen = sensor.expose(scene.picture, scene.blur_px2)[top:bottom, left:right][3:-3, 3:-3]

    difference = seen.astype(float) - expected
    assert abs(difference.mean()) < 0.2
    assert np.sqrt((difference**2).mean()) < 2.0
    assert np.abs(difference).max() < 15.0


def test_blur_has_the_variance_it_is_asked_for() -> None:
    for variance_px2 in (0.2, 0.36, 1.0, 4.0):
        kernel = blur_kernel(variance_px2).astype(float)
        taps = np.arange(len(kernel)) - len(kernel) // 2
        assert kernel.sum() == pytest.approx(1.0, abs=1e-6)
        assert (kernel * taps**2).sum() == pytest.approx(variance_px2, rel=0.15)


def test_a_pixels_area_counts_as_blur() -> None:
    assert pytest.approx(1.0 / 12.0) == PIXEL_VARIANCE_PX2


@pytest.mark.parametrize("height_m", [1.2, 5.0, 40.0])
def test_the_ground_is_flat_at_no_height(truth_at, height_m) -> None:
    picture = SimulatedCamera(Settings(), configured_calibration(Settings().camera)).capture(
        truth_at(30.0, 0.0, -height_m)
    )
    assert picture.shape == (480, 640)
    assert cv2.GaussianBlur(picture, (0, 0), 3.0).std() > 4.0


def test_the_same_seed_gives_the_same_pixels_and_another_seed_others(truth_at) -> None:
    truth, calibration = truth_at(0.0, 0.0, -8.0), configured_calibration(Settings().camera)
    first, again, other = ([SimulatedCamera(Settings(seed=seed), calibration).capture(truth)] for seed in (3, 3, 4))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_noise_differs_from_frame_to_frame_and_has_the_size_that_is_set(truth_at) -> None:
    camera = SimulatedCamera(Settings(), configured_calibration(Settings().camera))
    one, other = (camera.capture(truth_at(0.0, 0.0, -8.0)).astype(float) for _ in range(2))
    assert (one - other).std() / np.sqrt(2.0) == pytest.approx(3.0, rel=0.05)


@pytest.mark.parametrize(("down_m", "roll_rad"), [(2.0, 0.0), (0.0, 0.0), (-5.0, 1.2), (-5.0, 3.1), (-3000.0, 0.1)])
def test_any_pose_gives_a_picture(truth_at, down_m, roll_rad) -> None:
    camera = SimulatedCamera(Settings(), configured_calibration(Settings().camera))
    assert camera.capture(truth_at(1.0, 2.0, down_m, (roll_rad, 0.3, 0.0))).shape == (480, 640)


def test_what_rests_is_drawn_once_and_what_moves_as_often_as_it_smears(truth_at) -> None:
    still = exposure_instants_s(truth_at(0.0, 0.0, -5.0), np.eye(3), 293.0, 0.004)
    turning = exposure_instants_s(truth_at(0.0, 0.0, -5.0, rates_rps=(1.0, 0.0, 0.0)), np.eye(3), 293.0, 0.004)
    assert still == [0.0]
    assert len(turning) > 1
    assert sum(turning) == pytest.approx(0.0)
    assert max(turning) < 0.002


def test_motion_smears_edges_across_its_direction_only(truth_at) -> None:
    settings = Settings.model_validate({"camera": {"simulated": {"optics": {"noise_level": 0.0, "exposure_s": 0.02}}}})
    camera = SimulatedCamera(settings, configured_calibration(settings.camera))

    def steepest(picture: np.ndarray, axis: int) -> float:
        return float(np.abs(np.diff(picture[190:290, 270:370].astype(float), axis=axis)).max())

    still = camera.capture(truth_at(0.0, 0.0, -4.0))
    flying = camera.capture(truth_at(0.0, 0.0, -4.0, velocity_ned_mps=(2.0, 0.0, 0.0)))
    assert steepest(flying, axis=0) < 0.75 * steepest(still, axis=0)
    assert steepest(flying, axis=1) == pytest.approx(steepest(still, axis=1), rel=0.05)


@pytest.mark.parametrize(
    ("sunlight", "brighter"), [({"glare_level": 120.0, "elevation_deg": 85.0}, True), ({"shadow_depth": 0.6}, False)]
)
def test_sun_brightens_and_shadow_darkens_a_part_of_the_picture(truth_at, sunlight, brighter) -> None:
    def picture(**changes: object) -> np.ndarray:
        table = {"camera": {"simulated": {"optics": {"noise_level": 0.0}, "sunlight": changes}}}
        settings = Settings.model_validate(table)
        return (
            SimulatedCamera(settings, configured_calibration(settings.camera))
            .capture(truth_at(0.5, 0.0, -6.0))
            .astype(int)
        )

    change = picture(**sunlight) - picture()
    assert (np.abs(change) > 20).mean() > 0.02
    assert (np.abs(change) <= 2).mean() > 0.2
    assert (change >= -2).all() if brighter else (change <= 2).all()


def test_a_plain_ground_leaves_the_pad_as_it_is_and_all_around_it_one_shade(truth_at) -> None:
    def picture(ground: str) -> np.ndarray:
        optics = {"noise_level": 0.0, "vignetting": 0.0}
        settings = Settings.model_validate({"camera": {"simulated": {"ground": ground, "optics": optics}}})
        return SimulatedCamera(settings, configured_calibration(settings.camera)).capture(truth_at(0.0, 0.0, -4.0))

    textured, plain = picture("textured"), picture("plain")
    np.testing.assert_array_equal(textured[200:280, 280:360], plain[200:280, 280:360])
    assert (plain[:100] == MEAN_LEVEL).all()
    assert textured[:100].std() > 5.0


def test_the_mount_turns_the_picture_the_way_its_setting_says(truth_at) -> None:
    """Positive yaw is clockwise seen from above, so the scene turns anticlockwise in the picture."""
    settings = Settings.model_validate({"simulator": {"installation": {"mount_yaw_deg": 10.0}}})
    viewpoint = Viewpoint.from_truth(truth_at(0.0, 0.0, -5.0), mount_rotation(settings.simulator.installation))
    x, y, _ = viewpoint.in_camera(np.array([[0.0, 1.0, 0.0]]))[0]
    assert np.degrees(np.arctan2(x, -y)) == pytest.approx(-10.0)
