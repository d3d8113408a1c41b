"""A chessboard on a white board, for calibrating a camera that does not exist."""

from alight.markers.print_grid import chess_grid
from schemas.settings.camera import Board
from services.camera.sheet import Sheet


class ChessPrint:
    """Lies on the ground in the pad's place."""

    def __init__(self, columns: int, rows: int, square_m: float, board: Board) -> None:
        """Cut it out.

        Args:
            columns: Inner corners in a row.
            rows: Rows of inner corners.
            square_m: Edge of one square, metres.
            board: Shades, and how much white there is around, as a part of the longer side.
        """
        self.board_m = (max(columns, rows) + 1) * square_m * (1.0 + 2.0 * board.margin)
        grid = chess_grid(columns, rows, square_m, self.board_m)
        self._sheet = Sheet(grid, self.board_m, black_level=board.black_level, white_level=board.white_level)

    @property
    def whole(self) -> Sheet:
        """The one sheet."""
        return self._sheet

    def sheets(self, texel_m: float) -> tuple[Sheet, ...]:  # noqa: ARG002
        """The one sheet, however near."""
        return (self._sheet,)

    def draw_all(self, finest_texel_m: float) -> None:
        """Draw it in every size."""
        self._sheet.draw_all(finest_texel_m)
