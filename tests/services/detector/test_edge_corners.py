"""Corners by a marker's edges, whole in the picture or partly out of it."""

import numpy as np

from services.detector.edge_corners import refined_corners

CELLS = 7


def seen(studio, height_m: float, number: int):
    """A pad from near, moved aside the more the higher the number, and its corners by a guess that is half a pixel off."""
    random = np.random.default_rng(number)
    aside_m = (0.02 * number, -0.015 * number)
    shot = studio.shoot(*aside_m, -height_m, (*random.normal(0.0, 0.03, 2), random.uniform(-3.0, 3.0)))
    edges = refined_corners(shot.picture, shot.corners_px + random.normal(0.0, 0.5, (4, 2)), CELLS, studio.camera)
    return shot, edges


def outside(corners_px: np.ndarray) -> np.ndarray:
    """Which corners are not in the picture."""
    return ((corners_px < 0.0) | (corners_px > (639.0, 479.0))).any(axis=1)


def test_a_marker_that_is_whole_in_view_is_right_to_a_twentieth_of_a_pixel_and_claims_so(studio) -> None:
    scores = []
    for number, height_m in enumerate(np.linspace(1.2, 4.0, 12)):
        shot, edges = seen(studio, height_m, 0 if height_m < 2.0 else number)
        error_px = edges.corners_px - shot.corners_px
        assert np.abs(error_px).max() < 0.15
        scores.append(error_px.ravel() @ np.linalg.solve(edges.covariance_px2, error_px.ravel()) / 8.0)
    assert 0.2 < np.mean(scores) < 2.0


def test_a_corner_that_is_out_of_the_picture_claims_less_than_those_in_it_and_no_more_than_it_may(studio) -> None:
    scores = []
    for number in range(12, 30):
        shot, edges = seen(studio, 1.0, number)
        out = outside(shot.corners_px)
        if edges is None or not 0 < out.sum() < 4:
            continue
        variances_px2 = np.diag(edges.covariance_px2).reshape(4, 2).mean(axis=1)
        assert variances_px2[out].max() > variances_px2[~out].min()
        error_px = (edges.corners_px - shot.corners_px).ravel()
        scores.append(error_px @ np.linalg.solve(edges.covariance_px2, error_px) / 8.0)
    assert len(scores) >= 5
    assert np.mean(scores) < 3.0
