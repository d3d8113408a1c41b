"""ChArUco boards: a chessboard with a marker on each of its white squares."""

from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field

from alight.markers.family import FamilyError, dictionary

Array = NDArray[np.float64]

Count = Annotated[int, Field(ge=3, le=40)]
Length = Annotated[float, Field(gt=0.0, le=100.0)]


@dataclass(frozen=True)
class Charuco:
    """A board as OpenCV counts it: markers in order along the rows, from the upper left."""

    __pydantic_config__ = ConfigDict(extra="forbid", allow_inf_nan=False)

    columns: Count
    """Squares in a row, black and white."""
    rows: Count
    """Rows of squares."""
    square_m: Length
    """Edge of a square, metres."""
    marker_m: Length
    """Edge of a marker's black border, metres."""
    family: str
    """Marker family, such as `5x5_50`."""
    legacy: bool = False
    """Drawn as OpenCV before 4.6 did: with an even number of rows, the upper left square is white."""

    def board(self) -> cv2.aruco.CharucoBoard:
        """OpenCV's description of it.

        Raises:
            FamilyError: If there is no such marker family, or too few markers in it.
            ValueError: If the markers do not fit into their squares.
        """
        codes = dictionary(self.family)
        wanted, there_are = self.columns * self.rows // 2, int(codes.bytesList.shape[0])
        if wanted > there_are:
            raise FamilyError(f"family {self.family} has {there_are} markers, the board needs {wanted}")
        if self.marker_m >= self.square_m:
            raise ValueError("marker_m must be less than square_m")
        board = cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_m, self.marker_m, codes)
        board.setLegacyPattern(self.legacy)
        return board

    def marker_places(self) -> list[tuple[int, float, float]]:
        """Number and centre of each marker, x to the right and y up from the board's middle, metres."""
        board = self.board()
        return [
            (int(number), *self._from_middle(np.asarray(four, float).mean(axis=0)))
            for number, four in zip(np.ravel(board.getIds()), board.getObjPoints(), strict=True)
        ]

    def black_squares(self) -> list[tuple[float, float]]:
        """Centres of the squares without a marker, x to the right and y up from the board's middle, metres."""
        with_marker = {(round(x / self.square_m * 2), round(y / self.square_m * 2)) for _, x, y in self.marker_places()}
        centres = [
            (column - (self.columns - 1) / 2.0, (self.rows - 1) / 2.0 - row)
            for row in range(self.rows)
            for column in range(self.columns)
        ]
        return [
            (x * self.square_m, y * self.square_m)
            for x, y in centres
            if (round(2 * x), round(2 * y)) not in with_marker
        ]

    def chess_corners_m(self) -> Array:
        """Where squares meet, in OpenCV's order, (N, 2), x to the right and y up from the board's middle, metres."""
        corners = np.asarray(self.board().getChessboardCorners(), float)
        return np.array([self._from_middle(corner) for corner in corners])

    def _from_middle(self, point: Array) -> tuple[float, float]:
        """OpenCV counts from the upper left corner of the board, down."""
        half_width_m, half_height_m = self.columns * self.square_m / 2.0, self.rows * self.square_m / 2.0
        return float(point[0]) - half_width_m, half_height_m - float(point[1])
