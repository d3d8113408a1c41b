"""What covers a marker's outline moves no corner without its claim: leaves, snow, a shadow's edge."""

import cv2
import numpy as np
import pytest

from schemas.settings import Settings
from services.detector.cell_corners import corners_by_cells
from services.detector.detector import View
from services.detector.edge_corners import Outline, RefinedCorners, refined_corners
from services.detector.registry import detector_from
from services.detector.sharp_corners import is_borne_out, sharp_corners

CELLS = 7
CERTAIN_PX2 = 0.03**2 * np.eye(8)
STRIP = ((-0.35, 0.46), (0.25, 0.47), (0.25, 0.56), (-0.35, 0.55))
LEAF_AT_CORNER = ((0.36, 0.50), (0.50, 0.36), (0.62, 0.50), (0.50, 0.62))
LEAF_ON_EDGE = ((-0.10, 0.42), (0.10, 0.45), (0.12, 0.56), (-0.12, 0.58))
"""In the print's coordinates, x right and y up, metres; its edges are half a metre from its centre."""
COVERS = [(STRIP, 235), (STRIP, 35), (LEAF_AT_CORNER, 230), (LEAF_AT_CORNER, 110), (LEAF_ON_EDGE, 30)]


def covered(studio, shot, outline_m, level: int) -> np.ndarray:
    """The picture with something over a part of the print."""
    points = np.column_stack((np.array(outline_m), np.zeros(len(outline_m))))
    pixels = studio.camera.project(points @ shot.R_camera_marker.T + shot.centre_camera_m)
    picture = shot.picture.copy()
    cv2.fillPoly(picture, [np.rint(pixels * 16).astype(np.int32)], level, cv2.LINE_AA, 4)
    return picture


def found_in(backend: str, studio, picture):
    detector = detector_from(Settings.model_validate({"detector": {"backend": backend}}))
    return next(marker for marker in detector.detect(View(picture, 1, studio.camera)) if marker.id == 68)


@pytest.mark.parametrize("backend", ["aruco", "aided"])
@pytest.mark.parametrize(("outline_m", "level"), COVERS)
@pytest.mark.parametrize("height_m", [1.2, 1.6, 3.0])
def test_a_cover_on_the_outline_moves_no_corner_beyond_its_claim(
    studio, backend: str, outline_m, level: int, height_m: float
) -> None:
    shot = studio.shoot(0.02, -0.01, -height_m, (0.03, -0.02, 0.3))
    found = found_in(backend, studio, covered(studio, shot, outline_m, level))
    error_px = float(np.abs(found.corners_px - shot.corners_px).max())
    assert error_px < 0.5
    assert error_px < 6.0 * found.corner_sigma_px


def test_a_pad_that_nothing_covers_keeps_the_corners_of_its_edges(studio) -> None:
    for number, height_m in enumerate(np.linspace(1.2, 4.0, 8)):
        shot = studio.shoot(0.02, -0.01, -float(height_m), (0.03, -0.02, 0.7 * number))
        sharp = sharp_corners(shot.picture, shot.corners_px, CELLS, studio.camera)
        edges = refined_corners(shot.picture, shot.corners_px, CELLS, studio.camera)
        assert np.array_equal(sharp.corners_px, edges.corners_px)
        assert np.array_equal(sharp.covariance_px2, edges.covariance_px2)


def test_cells_find_corners_that_are_wrong_by_most_of_a_cell_and_claim_what_they_are_worth(studio) -> None:
    scores = []
    for number, height_m in enumerate(np.linspace(1.0, 6.0, 16)):
        shot = studio.shoot_at_random(float(height_m), number)
        side_px = float(np.linalg.norm(shot.corners_px[0] - shot.corners_px[1]))
        wrong_px = shot.corners_px.copy()
        wrong_px[number % 4] += 0.6 / CELLS * side_px * np.array((0.8, -0.6))
        by_cells = corners_by_cells(shot.picture, wrong_px, CELLS, studio.camera)
        error_px = (by_cells.corners_px - shot.corners_px).ravel()
        assert np.abs(error_px).max() < 0.5
        scores.append(error_px @ np.linalg.solve(by_cells.covariance_px2, error_px) / 8.0)
    assert 0.2 < np.mean(scores) < 2.0


def test_cells_bear_right_corners_out_and_no_wrong_ones(studio) -> None:
    shot = studio.shoot(0.02, -0.01, -1.5, (0.03, -0.02, 0.3))
    wrong_px = shot.corners_px + np.array(((0.0, 0.0), (0.0, 0.0), (1.0, -1.0), (0.0, 0.0)))
    for corners_px, right in ((shot.corners_px, True), (wrong_px, False)):
        corners = RefinedCorners(corners_px, CERTAIN_PX2, Outline.of(corners_px, studio.camera))
        assert is_borne_out(shot.picture, corners, CELLS, studio.camera) is right


def test_whole_edges_are_believed_where_the_cells_are_printed_beside_their_places(studio) -> None:
    shot = studio.shoot(0.0, 0.0, -2.0, (0.0, 0.0, 0.0))
    side_px = float(np.linalg.norm(shot.corners_px[0] - shot.corners_px[1]))
    low, high = (np.rint(shot.corners_px.mean(axis=0) + sign * 0.39 * side_px).astype(int) for sign in (-1, 1))
    picture = shot.picture.copy()
    inside = picture[low[1] : high[1], low[0] : high[0]]
    picture[low[1] + 1 : high[1] + 1, low[0] + 1 : high[0] + 1] = inside.copy()
    sharp = sharp_corners(picture, shot.corners_px, CELLS, studio.camera)
    assert np.abs(sharp.corners_px - shot.corners_px).max() < 0.15
    assert sharp.sigma_px < 0.05


def test_a_large_marker_whose_edges_and_cells_cannot_be_made_out_claims_a_quarter_of_a_cell(
    studio, monkeypatch
) -> None:
    shot = studio.shoot(0.0, 0.0, -1.5, (0.0, 0.0, 0.3))
    monkeypatch.setattr("services.detector.aruco.sharp_corners", lambda *_: None)
    found = found_in("aruco", studio, shot.picture)
    cell_px = float(np.linalg.norm(shot.corners_px[0] - shot.corners_px[1])) / CELLS
    assert found.corner_sigma_px == pytest.approx(0.25 * cell_px, rel=0.05)


def test_with_all_corners_out_of_the_picture_cells_tell_more_than_the_fit(studio) -> None:
    detector = detector_from(Settings.model_validate({"detector": {"backend": "aided"}}))
    looks = []
    for number, height_m in enumerate(np.arange(1.2, 0.44, -0.02)):
        shot = studio.shoot(0.0, 0.0, -float(height_m), (0.02, -0.02, 0.78))
        found = next(iter(detector.detect(View(shot.picture, 10**10 + number * 33_333_333, studio.camera))), None)
        out = ((shot.corners_px < 0.0) | (shot.corners_px > (639.0, 479.0))).any(axis=1)
        if found is not None and out.all():
            looks.append((float(np.abs(found.corners_px - shot.corners_px).max()), found.corner_sigma_px))
    errors_px, sigmas_px = np.array(looks).T
    assert len(looks) >= 5
    assert np.median(errors_px) < 0.5
    assert np.median(sigmas_px) < 0.3
    assert (errors_px / sigmas_px).max() < 5.0
