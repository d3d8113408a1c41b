"""The boards that cameras are calibrated with, and finding their corners in a picture."""

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.markers.family import FamilyError, dictionary

Array = NDArray[np.float64]
Grey = NDArray[np.uint8]

_HOW = (
    "chessboard:COLUMNSxROWS:SQUARE_M (inner corners), charuco:COLUMNSxROWS:SQUARE_M:MARKER_M:FAMILY[:legacy] (squares), or "
    "gridboard:COLUMNSxROWS:MARKER_M:GAP_M:FAMILY (markers)"
)
_LEAST_CORNERS = 8
_REFINE_PART = 0.35
_REFINE_PX = (2, 11)
_REFINE_STEPS = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 60, 1e-4)


class BoardError(ValueError):
    """A description of a board that cannot be used, in one line with the remedy."""


@dataclass(frozen=True)
class FoundCorners:
    """Corners of a board in one picture."""

    points_m: Array
    """(N, 3), in the board's plane, z = 0, metres."""
    pixels: Array
    """(N, 2), pixels; the centre of the upper left pixel is (0, 0)."""


class CalibrationBoard(Protocol):
    """A flat board with corners in known places."""

    def find(self, picture: Grey) -> FoundCorners | None:
        """Its corners in a picture, (height, width); None if it is not (enough) in view."""
        ...


def board_from(text: str) -> CalibrationBoard:
    """The board that a text describes, such as `chessboard:9x6:0.20`.

    Raises:
        BoardError: If it describes none.
    """
    kind, *words = text.split(":")
    try:
        if kind == "chessboard" and len(words) == 2:
            return Chessboard(*_counts(words[0], 2), _length_m(words[1]))
        if kind == "charuco" and (len(words) == 4 or (len(words) == 5 and words[4] == "legacy")):
            charuco = cv2.aruco.CharucoBoard(
                _counts(words[0], 3), _length_m(words[1]), _length_m(words[2]), dictionary(words[3])
            )
            charuco.setLegacyPattern(len(words) == 5)
            return Charuco(charuco)
        if kind == "gridboard" and len(words) == 4:
            size = _counts(words[0], 1)
            return MarkerGrid(cv2.aruco.GridBoard(size, _length_m(words[1]), _length_m(words[2]), dictionary(words[3])))
    except FamilyError as error:
        raise BoardError(f"--board {text}: {error}") from None
    except (ValueError, cv2.error, SystemError):  # OpenCV's constructors leave the latter behind
        raise BoardError(f"--board {text}: wrong numbers: give {_HOW}") from None
    raise BoardError(f"--board {text}: not a board: give {_HOW}")


def _counts(text: str, least: int) -> tuple[int, int]:
    columns, rows = (int(word) for word in text.split("x"))
    if not (least <= columns <= 100 and least <= rows <= 100):
        raise ValueError(text)
    return columns, rows


def _length_m(text: str) -> float:
    length_m = float(text)
    if not 0.0 < length_m <= 100.0:
        raise ValueError(text)
    return length_m


@dataclass(frozen=True)
class Chessboard:
    """Black and white squares; all inner corners have to be in view."""

    columns: int
    """Inner corners in a row."""
    rows: int
    square_m: float

    def find(self, picture: Grey) -> FoundCorners | None:
        """OpenCV's search, then each corner where the brightness gradients around it say."""
        flags = cv2.CALIB_CB_ADAPTIVE_THRESH + cv2.CALIB_CB_NORMALIZE_IMAGE + cv2.CALIB_CB_FAST_CHECK
        found, corners = cv2.findChessboardCorners(picture, (self.columns, self.rows), None, flags)
        if not found:
            return None
        rough = np.asarray(corners, float).reshape(self.rows, self.columns, 2)
        places = np.stack(np.meshgrid(np.arange(self.columns), np.arange(self.rows)), axis=-1).reshape(-1, 2)
        points_m = np.column_stack((places * self.square_m, np.zeros(len(places))))
        return FoundCorners(points_m, _refined(picture, rough))


def _refined(picture: Grey, corners: Array) -> Array:
    """Each corner from a neighbourhood that reaches no other corner; (N, 2)."""
    beside = np.concatenate(
        [np.linalg.norm(np.diff(corners, axis=axis), axis=-1).ravel() for axis in (0, 1) if corners.shape[axis] > 1]
    )
    reach = int(np.clip(_REFINE_PART * beside.min(), *_REFINE_PX))
    flat = np.ascontiguousarray(corners.reshape(-1, 1, 2), np.float32)
    sharper = cv2.cornerSubPix(picture, flat, (reach, reach), (-1, -1), _REFINE_STEPS)
    return np.asarray(sharper, float).reshape(-1, 2)


class Charuco:
    """A chessboard with markers on its white squares; a part of it is enough."""

    def __init__(self, board: cv2.aruco.CharucoBoard) -> None:
        self._board = board
        self._detector = cv2.aruco.CharucoDetector(board)

    def find(self, picture: Grey) -> FoundCorners | None:
        """The chessboard corners that lie between markers."""
        corners, numbers, _, _ = self._detector.detectBoard(picture)
        if numbers is None or len(numbers) < _LEAST_CORNERS:
            return None
        points = np.asarray(self._board.getChessboardCorners(), float)[np.ravel(numbers)]
        return _spread_out(points, np.asarray(corners, float).reshape(-1, 2))


class MarkerGrid:
    """Markers in rows and columns; a part of them is enough."""

    def __init__(self, board: cv2.aruco.GridBoard) -> None:
        self._board = board
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._detector = cv2.aruco.ArucoDetector(board.getDictionary(), parameters)

    def find(self, picture: Grey) -> FoundCorners | None:
        """The corners of the markers."""
        corners, numbers, _ = self._detector.detectMarkers(picture)
        if numbers is None:
            return None
        points, pixels = self._board.matchImagePoints(corners, numbers)
        if points is None or len(points) < _LEAST_CORNERS:
            return None
        return _spread_out(np.asarray(points, float).reshape(-1, 3), np.asarray(pixels, float).reshape(-1, 2))


def _spread_out(points_m: Array, pixels: Array) -> FoundCorners | None:
    """Nothing, if all corners lie on one line: they would say nothing of the board's pose."""
    across = np.linalg.svd(points_m[:, :2] - points_m[:, :2].mean(axis=0), compute_uv=False)
    return FoundCorners(points_m, pixels) if across[1] > 0.05 * across[0] else None
