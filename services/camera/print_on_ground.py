"""What lies on the ground to be looked at: the pad, or a board for calibration."""

from typing import Protocol

from services.camera.sheet import Sheet


class PrintOnGround(Protocol):
    """A square board with its middle in the origin of the pad's frame."""

    board_m: float
    """Its edge, metres."""

    @property
    def whole(self) -> Sheet:
        """All of it on one sheet."""
        ...

    def sheets(self, texel_m: float) -> tuple[Sheet, ...]:
        """What to draw, one over the other, where texels of this size are wanted, metres."""
        ...

    def draw_all(self, finest_texel_m: float) -> None:
        """Draw it in every size that a texel from this one up needs, so that no frame has to wait for it."""
        ...
