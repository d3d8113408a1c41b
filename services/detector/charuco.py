"""The backend `charuco`: OpenCV's detector of markers, their corners taken from the chessboard that they stand on.

Where two black squares meet, the picture has a saddle whose place neither blur nor light moves, unlike a marker's corner.
"""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from alight.markers.layout import PadLayout, PlacedMarker
from schemas.settings.detector import Aruco
from services.detector.detector import FoundMarker, Tally, View
from services.detector.nested_aruco import LevelSearch
from services.detector.quadrilateral import is_sound

Array = NDArray[np.float64]

_CHESS_SIGMA_PX = 0.07
"""Standard deviation of a chessboard corner's coordinate, measured on rendered boards from 1.8 m to 4 m."""
_SHARED = 2**0.5
"""Every chessboard corner speaks for the markers on both sides of it; each may count it for half."""


class NoChessboardError(ValueError):
    """A pad without a chessboard, in one line with the remedy."""


class CharucoBackend:
    """Looks for the markers of one ChArUco board."""

    name = "charuco"

    def __init__(self, layout: PadLayout, settings: Aruco) -> None:
        """Set OpenCV's detectors up.

        Args:
            layout: The pad, which must be a ChArUco board.
            settings: Parameters of the search for markers.

        Raises:
            NoChessboardError: If the pad is something else.
        """
        if layout.charuco is None:
            raise NoChessboardError(
                f"the detector charuco needs a pad with a table [charuco], such as pad.layout=charuco, not {layout.name!r}"
            )
        self._markers = layout.markers
        self._search = LevelSearch(layout.charuco.family, layout.markers, settings, most=len(layout.markers))
        self._board = cv2.aruco.CharucoDetector(layout.charuco.board())
        self._enclosing = _enclosing(layout.markers, layout.charuco.square_m, layout.charuco.chess_corners_m())
        self._tally = Tally({"from_chessboard": 0, "from_own_edges": 0})

    def detect(self, view: View) -> tuple[FoundMarker, ...]:
        """The markers in the frame: those within four chessboard corners by these, others by their own edges."""
        found = self._search.detect(view)
        chess_px = self._chess_corners_px(view, found) if len(found) > 1 else {}
        markers = [self._by_chessboard(view, marker, chess_px) or marker for marker in found]
        for before, after in zip(found, markers, strict=True):
            self._tally.add("from_own_edges" if before is after else "from_chessboard")
        return tuple(markers)

    def counters(self) -> Mapping[str, int]:
        """Those of the search, and where corners come from."""
        return {**self._search.counters(), **self._tally.counts}

    def _chess_corners_px(self, view: View, found: list[FoundMarker]) -> dict[int, Array]:
        """Chessboard corners by OpenCV's number."""
        corners = [np.ascontiguousarray(marker.corners_px[None], np.float32) for marker in found]
        numbers = np.array([[marker.id] for marker in found], np.int32)
        self._board.setCharucoParameters(_parameters(view.camera))
        try:
            places, which, _, _ = self._board.detectBoard(view.picture, markerCorners=corners, markerIds=numbers)
        except cv2.error:  # some arrangements of markers do not fit the board
            return {}
        if which is None or places is None:
            return {}
        flat = np.asarray(places, float).reshape(-1, 2)
        return {int(number): place for number, place in zip(np.ravel(which), flat, strict=True)}

    def _by_chessboard(self, view: View, marker: FoundMarker, chess_px: dict[int, Array]) -> FoundMarker | None:
        """The marker between the chessboard corners around it; None if one of them is missing, or they are elsewhere."""
        enclosing = self._enclosing.get(marker.id)
        if enclosing is None or any(number not in chess_px for number in enclosing.numbers):
            return None
        square_px = np.array([chess_px[number] for number in enclosing.numbers])
        corners, gain = enclosing.marker_px(square_px, view.camera)
        agrees_px = _CHESS_SIGMA_PX + 5.0 * marker.corner_sigma_px + 0.5
        if not is_sound(corners) or float(np.abs(corners - marker.corners_px).max()) > agrees_px:
            return None
        return FoundMarker(marker.family, marker.id, corners, _CHESS_SIGMA_PX * _SHARED * gain)


class _Enclosing:
    """The chessboard corners around one marker."""

    def __init__(self, numbers: tuple[int, ...], marker_part: float) -> None:
        """Take their numbers, in the order of a marker's corners, and the marker's side as a part of the square's."""
        self.numbers = numbers
        self._marker_part = marker_part

    def marker_px(self, square_px: Array, camera: PinholeCamera | None) -> tuple[Array, float]:
        """Corners of the marker (4, 2), pixels, and how much less than the square's they scatter."""
        flat = square_px if camera is None else camera.undistorted(square_px)
        unit = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]], np.float32)
        homography = cv2.getPerspectiveTransform(unit, flat.astype(np.float32))
        inside = (unit * self._marker_part).reshape(-1, 1, 2)
        corners = np.asarray(cv2.perspectiveTransform(inside, homography), float).reshape(4, 2)
        # Each corner is nearly a mean of the square's, weighed by its distances from the opposite edges.
        near, far = (1.0 + self._marker_part) / 2.0, (1.0 - self._marker_part) / 2.0
        return corners if camera is None else camera.pixels(corners), near**2 + far**2


def _enclosing(markers: tuple[PlacedMarker, ...], square_m: float, chess_m: Array) -> dict[int, _Enclosing]:
    """For each marker whose square has no edge of the board, the chessboard corners around it."""
    half = square_m / 2.0
    around: dict[int, _Enclosing] = {}
    for marker in markers:
        wanted = np.array([[-half, half], [half, half], [half, -half], [-half, -half]]) + np.array(
            (marker.x_m, marker.y_m)
        )
        distances = np.linalg.norm(chess_m[None] - wanted[:, None], axis=2)
        if float(distances.min(axis=1).max()) < 0.01 * square_m:
            numbers = tuple(int(number) for number in distances.argmin(axis=1))
            around[marker.id] = _Enclosing(numbers, marker.side_m / square_m)
    return around


def _parameters(camera: PinholeCamera | None) -> cv2.aruco.CharucoParameters:
    parameters = cv2.aruco.CharucoParameters()
    if camera is not None:
        parameters.cameraMatrix, parameters.distCoeffs = camera.matrix, camera.distortion
    return parameters
