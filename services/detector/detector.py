"""What a detector is: something that finds markers in a picture. Poses are computed from its corners, for all alike."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera

GreyPicture = NDArray[np.uint8]
Corners = NDArray[np.float64]


@dataclass(frozen=True)
class View:
    """All that a detector may use of one frame."""

    picture: GreyPicture
    """(height, width), grey levels; read only."""
    captured_at_ns: int
    """Middle of the exposure, UTC ns; rises from frame to frame."""
    camera: PinholeCamera | None = None
    """The calibrated camera, where there is one for this size of picture."""


@dataclass(frozen=True)
class FoundMarker:
    """A marker in the picture, before its pose."""

    family: str
    """Marker family."""
    id: int
    """Its number in the family."""
    corners_px: Corners
    """(4, 2): upper left, upper right, lower right, lower left corner of the print; the upper left pixel's centre is (0, 0)."""
    corner_sigma_px: float
    """Standard deviation of one corner coordinate, pixels."""


class Detector(Protocol):
    """Finds markers. May remember what it saw in the frames before."""

    name: str
    """Its name in the settings and in messages."""

    def detect(self, view: View) -> tuple[FoundMarker, ...]:
        """The markers in one frame, any order."""
        ...

    def counters(self) -> Mapping[str, int]:
        """Its own counters since start, for `health`."""
        ...


@dataclass(frozen=True)
class WantedMarker:
    """The marker that matters most: the pad's."""

    family: str
    id: int


@dataclass
class Tally:
    """Counts by name, beginning at zero for the names given."""

    counts: dict[str, int] = field(default_factory=dict)

    def add(self, name: str) -> None:
        """One more."""
        self.counts[name] = self.counts.get(name, 0) + 1
