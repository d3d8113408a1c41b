"""Where pictures come from that nobody renders: the edge of the camera service, behind which there are files or devices."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class SourcedPicture:
    """One picture and where it is from."""

    pixels: NDArray[np.uint8]
    """(height, width) grey or (height, width, 3) blue, green, red."""
    name: str
    """File name, with the frame's number in a video; device."""
    frame: int | None = None
    """The frame's number in a video."""


class PictureSource(Protocol):
    """Hands out pictures one by one."""

    undecodable: int
    """How many it had to skip since the start."""

    def next_picture(self) -> SourcedPicture | None:
        """The next one; None when there is none (left)."""
        ...

    def complaint(self) -> str:
        """What is wrong, in words; empty when all is well."""
        ...

    def close(self) -> None:
        """Let go of what is open."""
        ...
