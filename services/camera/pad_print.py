"""The print itself: a white board with markers, as sheets that are drawn one over the other."""

from functools import partial

from alight.markers.layout import InkSquare, PlacedMarker
from alight.markers.print_grid import print_grid, split_askew
from services.camera.sheet import Sheet

_LARGE_PART = 0.5


class PadPrint:
    """A square board with markers on it.

    From afar one sheet shows it all, and every texel is the mean over its area whatever lies there. So near that this sheet would be
    blurred, the smaller markers are sheets of their own, over one with the large markers alone.
    """

    def __init__(
        self,
        markers: tuple[PlacedMarker, ...],
        *,
        board_m: float,
        black_level: float,
        white_level: float,
        ink: tuple[InkSquare, ...] = (),
    ) -> None:
        """Cut the board up.

        Args:
            markers: The markers, largest first; where they overlap, the smaller one is on top.
            board_m: Edge of the white board, metres.
            black_level: Brightness of the ink, grey levels.
            white_level: Brightness of the board, grey levels.
            ink: Black squares under the markers.
        """
        self.board_m = board_m
        sheet = partial(_sheet, black_level=black_level, white_level=white_level)
        large = tuple(marker for marker in markers if marker.side_m >= _LARGE_PART * markers[0].side_m)
        small = markers[len(large) :]
        self._whole = sheet(markers, board_m, ink=ink)
        self._under = sheet(large, board_m, ink=ink) if small else self._whole
        self._small = tuple(
            sheet(
                (PlacedMarker(marker.family, marker.id, marker.side_m),),
                marker.side_m,
                place_m=(marker.x_m, marker.y_m),
                rotation_rad=marker.rotation_rad,
            )
            for marker in small
        )

    @property
    def whole(self) -> Sheet:
        """All of it on one sheet."""
        return self._whole

    def draw_all(self, finest_texel_m: float) -> None:
        """Make every texture with texels down to this size now, metres; see `Sheet.draw_all`."""
        for sheet in {self._whole, self._under, *self._small}:
            sheet.draw_all(finest_texel_m)

    def sheets(self, texel_m: float) -> tuple[Sheet, ...]:
        """What to draw, one over the other, where texels of this size are wanted, metres."""
        if self._small and texel_m < self._whole.finest_texel_m:
            return (self._under, *self._small)
        return (self._whole,)


def _sheet(
    markers: tuple[PlacedMarker, ...],
    side_m: float,
    *,
    black_level: float,
    white_level: float,
    ink: tuple[InkSquare, ...] = (),
    place_m: tuple[float, float] = (0.0, 0.0),
    rotation_rad: float = 0.0,
) -> Sheet:
    upright, askew = split_askew(markers)
    return Sheet(
        print_grid(upright, side_m, ink),
        side_m,
        black_level=black_level,
        white_level=white_level,
        askew=askew,
        place_m=place_m,
        rotation_rad=rotation_rad,
    )
