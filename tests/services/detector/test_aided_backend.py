import math

import numpy as np
import pytest

from alight.geometry.rotation import quaternion_from_R
from alight.markers.layout import layout_from
from schemas.settings import Settings
from services.camera.viewpoint import R_ned_marker
from services.detector.aided.alignment import Aligner
from services.detector.aided.guess import Blur, Guess
from services.detector.aided.light import ShadowEdge
from services.detector.aided.marker_view import MarkerView, TiltPrior
from services.detector.aided.noise import noise_level
from services.detector.aided.pattern import pattern_of
from services.detector.aided.pixel_rays import PixelRays
from services.detector.aided.search import PatternSearch
from services.detector.aided.verification import LARGEST_CORNER_SIGMA_PX
from services.detector.detector import Prior, View
from services.detector.registry import detector_from

FRAME_NS = 33_333_333
APART_NS = 10 * 1_000_000_000


def aided():
    return detector_from(Settings.model_validate({"detector": {"backend": "aided"}}))


def pad_in(markers):
    return next((marker for marker in markers if marker.id == 68), None)


def prior_of(shot, height_m: float, **more) -> Prior:
    q = quaternion_from_R(R_ned_marker(0.0) @ shot.R_camera_marker.T)
    return Prior(height_m=height_m, height_sigma_m=0.05 * height_m, q_ned_camera=q, attitude_sigma_rad=0.02, **more)


@pytest.fixture
def aligner(studio) -> Aligner:
    layout = layout_from(Settings().pad)
    return Aligner(pattern_of(layout.markers[0], layout), 1.0, PixelRays(studio.camera))


@pytest.mark.parametrize("height_m", [8.0, 16.0, 24.0, 30.0])
def test_it_finds_the_pad_knowing_only_what_is_printed_on_it(studio, height_m) -> None:
    detector, errors = aided(), []
    for number in range(5):
        shot = studio.shoot_at_random(height_m, number)
        found = pad_in(detector.detect(View(shot.picture, (number + 1) * APART_NS, studio.camera)))
        if found is not None:
            errors.append(np.sqrt(np.mean((found.corners_px - shot.corners_px) ** 2)))
    assert len(errors) == 5
    assert np.median(errors) < 0.15


def test_from_forty_metres_it_finds_the_pad_when_told_height_and_attitude(studio) -> None:
    detector, hits = aided(), 0
    for number in range(5):
        shot = studio.shoot_at_random(40.0, number)
        found = pad_in(
            detector.detect(View(shot.picture, (number + 1) * APART_NS, studio.camera, prior_of(shot, 40.0)))
        )
        hits += found is not None and np.abs(found.corners_px - shot.corners_px).max() < 1.0
    assert hits >= 4


def test_it_follows_the_pad_without_searching_again(studio) -> None:
    detector = aided()
    for number, height_m in enumerate(np.linspace(28.0, 6.0, 25), start=1):
        shot = studio.shoot(0.05 * height_m, 0.1 * height_m, -height_m, (0.02, -0.01, 0.4))
        found = pad_in(detector.detect(View(shot.picture, number * FRAME_NS, studio.camera)))
        assert np.abs(found.corners_px - shot.corners_px).max() < 0.4
    assert detector.counters()["tracked"] >= 22


def test_a_large_pad_is_laid_out_by_its_edges_to_a_twentieth_of_a_pixel_and_claims_no_less(studio) -> None:
    detector, errors, claims = aided(), [], []
    for number, height_m in enumerate((1.2, 1.5, 1.8, 2.1, 2.4), start=1):
        shot = studio.shoot(0.02 * height_m, -0.03 * height_m, -height_m, (0.03, -0.02, 0.2 * number))
        found = pad_in(detector.detect(View(shot.picture, number * APART_NS, studio.camera)))
        errors.append(np.sqrt(np.mean((found.corners_px - shot.corners_px) ** 2)))
        claims.append(found.corner_sigma_px)
    assert max(errors) < 0.05
    assert np.mean(np.square(errors)) < 2.0 * np.mean(np.square(claims))
    assert detector.counters()["sharpened_by_edges"] >= 3


def test_another_marker_of_the_family_is_not_taken_for_the_pad(studio) -> None:
    other = detector_from(Settings.model_validate({"pad": {"id": 69}, "detector": {"backend": "aided"}}))
    for number, height_m in enumerate((8.0, 16.0, 22.0, 28.0), start=1):
        shot = studio.shoot_at_random(height_m, number)
        prior = prior_of(shot, height_m)
        for view in (
            View(shot.picture, number * APART_NS, studio.camera),
            View(shot.picture, number * APART_NS + APART_NS // 2, studio.camera, prior),
        ):
            assert not any(marker.id == 69 for marker in other.detect(view))


def test_a_prediction_elsewhere_loses_nothing(studio) -> None:
    shot = studio.shoot_at_random(20.0, 3)
    wrong = prior_of(shot, 8.0, centre_px=(30.0, 30.0), centre_sigma_px=5.0)
    assert pad_in(aided().detect(View(shot.picture, 1, studio.camera, wrong))) is not None


@pytest.mark.parametrize("prior", [Prior(height_at_most_m=0.5), Prior(height_m=3.0, height_sigma_m=0.3)])
def test_a_pad_that_should_be_too_near_to_be_missed_is_sought_once_a_second_and_found_if_that_is_wrong(
    studio, prior
) -> None:
    detector = aided()
    far = studio.shoot_at_random(26.0, 1).picture
    ground = np.full_like(far, 120)
    frames = [ground] * 10 + [far] * 32
    found = [
        number
        for number, picture in enumerate(frames)
        if pad_in(detector.detect(View(picture, APART_NS + number * FRAME_NS, studio.camera, prior)))
    ]
    assert found
    assert found[0] <= 41


def test_a_pad_that_grows_out_of_the_picture_is_given_up_before_its_corners_are_made_up(studio) -> None:
    detector, sigmas_px, errors_px = aided(), [], []
    for number, height_m in enumerate(np.arange(1.4, 0.2, -0.03)):
        shot = studio.shoot(0.05, -0.05, -float(height_m), (0.03, -0.02, 0.4))
        found = pad_in(detector.detect(View(shot.picture, APART_NS + number * FRAME_NS, studio.camera)))
        if found is not None:
            sigmas_px.append(found.corner_sigma_px)
            errors_px.append(np.abs(found.corners_px - shot.corners_px).max())
    assert len(sigmas_px) > 10
    assert max(sigmas_px) <= LARGEST_CORNER_SIGMA_PX
    assert max(np.array(errors_px) / np.array(sigmas_px)) < 5.0


def test_on_the_pad_itself_hardly_anything_is_sought(studio) -> None:
    searches = []
    ground = np.full((480, 640), 120, np.uint8)
    for prior in (None, Prior(height_at_most_m=0.5)):
        detector = aided()
        for number in range(45):
            detector.detect(View(ground, APART_NS + number * FRAME_NS, studio.camera, prior))
        searches.append(detector.counters()["pattern_searches"])
    assert searches[0] >= 30
    assert searches[1] <= 2


@pytest.mark.parametrize("height_m", [6.0, 15.0, 30.0])
def test_in_still_and_evenly_lit_pictures_the_fit_is_no_less_exact_than_it_says(studio, aligner, height_m) -> None:
    ratios = []
    for number in range(8):
        shot = studio.shoot_at_random(height_m, number)
        begin = MarkerView(shot.R_camera_marker, shot.centre_camera_m * 1.01)
        fit = aligner.fitted(shot.picture, Guess(begin), TiltPrior(shot.R_camera_marker[:, 2], 0.05), 12)
        error = (fit.corners_px - shot.corners_px).ravel()
        ratios.append(error @ error / np.trace(fit.corner_covariance_px2))
        assert fit.plausible
    assert np.mean(ratios) < 1.5


def test_the_slopes_of_the_pattern_are_those_of_its_shades() -> None:
    layout = layout_from(Settings().pad)
    pattern = pattern_of(layout.markers[0], layout)
    u, v = np.random.default_rng(1).uniform(-1.0, 8.0, (2, 200))
    step = 1e-4
    here, right = pattern.shades(u, v, 0.7, 0.6), pattern.shades(u + step, v, 0.7, 0.6)
    below = pattern.shades(u, v + step, 0.7, 0.6)
    assert np.allclose((right.white - here.white) / step, here.white_u, atol=5e-3)
    assert np.allclose((below.white - here.white) / step, here.white_v, atol=5e-3)
    assert np.allclose((right.board - here.board) / step, here.board_u, atol=5e-3)


def test_the_rays_between_the_nodes_are_those_of_the_lens(studio) -> None:
    rays = PixelRays(studio.camera).block(0, 0, 640, 480, 1)
    pixels = np.array([(0, 0), (639, 479), (3, 477), (321, 238), (600, 17)])
    exact = studio.camera.undistorted(pixels.astype(float))
    assert np.abs(rays[:2, pixels[:, 1] * 640 + pixels[:, 0]].T - exact).max() * 293.0 < 2e-3


def test_the_ray_of_any_place_is_that_of_the_lens_in_the_picture_and_beside_it(studio) -> None:
    rays = PixelRays(studio.camera)
    for places in (np.random.default_rng(4).uniform(0.0, 479.0, (50, 2)), np.array([(-3.0, 20.0), (639.0, 479.0)])):
        assert np.abs(rays.at(places) - studio.camera.undistorted(places)).max() * 293.0 < 5e-3


def test_the_likeliest_place_in_several_pictures_is_where_the_pad_is(studio) -> None:
    layout = layout_from(Settings().pad)
    search = PatternSearch(pattern_of(layout.markers[0], layout))
    shot = studio.shoot(1.0, 2.0, -36.0, (0.0, 0.0, 0.7))
    ground = np.full((80, 120), 120, np.uint8)
    best = search.proposals([ground, shot.picture, ground], 8)[0]
    assert best.picture == 1
    assert np.allclose((best.x_px, best.y_px), shot.corners_px.mean(axis=0), atol=1.0)
    assert search.proposals([ground, ground], 8) == []


def test_a_shadows_edge_across_the_pad_is_found(studio, aligner) -> None:
    guess = Guess(
        MarkerView(np.diag((1.0, -1.0, -1.0)), np.array((0.2, 0.1, 14.0))), Blur(), ShadowEdge(0.8, 0.5, -0.8)
    )
    model = aligner.rendered(guess, 300, 220, 48, 48, 1)
    picture = np.full((480, 640), 128, np.uint8)
    u, v, _ = aligner.places(PixelRays(studio.camera).block(300, 220, 48, 48, 1), guess.view)
    beyond = (u - 3.5) * math.cos(0.8) + (v - 3.5) * math.sin(0.8) > 0.5
    picture[220:268, 300:348] = model * np.where(beyond, math.exp(-0.8), 1.0).reshape(48, 48)
    even = aligner.attempted(picture, Guess(guess.view), TiltPrior(np.array((0.0, 0.0, -1.0)), 0.02), (0.0,) * 8)
    begin = aligner.shaded(even)
    assert begin is not None
    shaded = aligner.fitted(picture, begin, TiltPrior(np.array((0.0, 0.0, -1.0)), 0.02), 12)
    assert shaded.residual < 0.6 * even.residual
    assert abs(shaded.guess.edge.log_factor) == pytest.approx(0.8, abs=0.15)


def test_noise_is_measured_beside_texture() -> None:
    random = np.random.default_rng(5)
    picture = np.clip(120.0 + random.normal(0.0, 4.0, (480, 640)), 0, 255)
    picture[:, :200] += 60.0 * (random.random((480, 200)) > 0.5)
    assert noise_level(np.clip(picture, 0, 255).astype(np.uint8)) == pytest.approx(4.0, rel=0.1)
