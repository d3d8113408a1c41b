import numpy as np
import pytest

from schemas.settings import Settings
from schemas.settings.detector import Aruco
from services.detector.board_pose import pad_view
from services.detector.charuco import CharucoBackend, NoChessboardError
from services.detector.detector import View
from services.detector.registry import detector_from
from services.detector.square_pose import located


@pytest.fixture
def board(studio_with):
    return studio_with(layout="charuco")


def errors_px(found, board, shot):
    placed = {marker.id: marker.corners_m() for marker in board.layout.markers}
    return np.array(
        [
            marker.corners_px - board.camera.project(placed[marker.id] @ shot.R_camera_marker.T + shot.centre_camera_m)
            for marker in found
        ]
    )


def test_corners_come_from_the_chessboard_and_are_as_sure_as_it_says(board) -> None:
    detector = CharucoBackend(board.layout, Aruco())
    errors, normalised = [], []
    for number in range(10):
        shot = board.shoot_at_random(2.0, number)
        found = detector.detect(View(shot.picture, 1, board.camera))
        off = errors_px(found, board, shot)
        errors.append(off.reshape(-1, 2))
        normalised += [
            float(np.mean(each**2)) / marker.corner_sigma_px**2 for each, marker in zip(off, found, strict=True)
        ]
    assert detector.counters()["from_chessboard"] >= 30
    assert np.sqrt(np.mean(np.concatenate(errors) ** 2)) < 0.08
    assert 0.1 < np.mean(normalised) < 2.0


def test_the_board_gives_one_pose(board) -> None:
    shot = board.shoot(0.2, -0.1, -2.5, (0.1, -0.05, 2.0))
    found = CharucoBackend(board.layout, Aruco()).detect(View(shot.picture, 1, board.camera))
    markers = [located(each, board.layout.markers[0].side_m, board.camera) for each in found]
    pad = pad_view(markers, board.layout, board.camera)
    assert len(pad.used) == 12
    assert pad.left_out == ()
    error = np.array(pad.poses[0].position_camera_m) - shot.centre_camera_m
    covariance = np.array(pad.poses[0].covariance).reshape(6, 6)[:3, :3]
    assert error @ np.linalg.solve(covariance, error) < 16.3  # 99.9 % of chi-square with three degrees of freedom


def test_a_board_half_out_of_view_is_found_by_what_is_left(board) -> None:
    shot = board.shoot(1.3, 1.6, -1.6)
    found = CharucoBackend(board.layout, Aruco()).detect(View(shot.picture, 1, board.camera))
    assert 0 < len(found) < 12
    assert np.abs(errors_px(found, board, shot)).max() < 0.5


def test_without_a_chessboard_there_is_a_remedy() -> None:
    with pytest.raises(NoChessboardError, match=r"needs a pad with a table \[charuco\], such as pad.layout=charuco"):
        detector_from(Settings.model_validate({"detector": {"backend": "charuco"}}))
