"""What a detector is: something that finds markers in a picture. Poses are computed from its corners, for all alike."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from schemas.message import Quaternion

GreyPicture = NDArray[np.uint8]
Corners = NDArray[np.float64]


@dataclass(frozen=True)
class Prior:
    """What is known beforehand of how the pad looks in one frame. Each part may be absent, and any may be wrong."""

    height_m: float | None = None
    """Of the camera above the plane of the pad, metres."""
    height_sigma_m: float = 0.0
    """Its standard deviation, metres."""
    height_at_most_m: float | None = None
    """Where the height is not known: what it hardly exceeds, metres."""
    q_ned_camera: Quaternion | None = None
    """The camera's attitude: takes camera to NED coordinates; w, x, y, z."""
    attitude_sigma_rad: float = 0.0
    """Standard deviation of that about each horizontal axis, and of the pad's own tilt, rad."""
    centre_px: tuple[float, float] | None = None
    """Where the pad's centre should be in the picture, distorted pixels; it may be outside."""
    centre_sigma_px: float = 0.0
    """Standard deviation of each of its coordinates, pixels."""
    azimuth_rad: float | None = None
    """Azimuth of the print's upward direction, rad."""
    azimuth_sigma_rad: float = 0.0
    """Its standard deviation against the camera's heading, rad."""


@dataclass(frozen=True)
class View:
    """All that a detector may use of one frame."""

    picture: GreyPicture
    """(height, width), grey levels; read only."""
    captured_at_ns: int
    """Middle of the exposure, UTC ns; rises from frame to frame."""
    camera: PinholeCamera | None = None
    """The calibrated camera, where there is one for this size of picture."""
    prior: Prior | None = None
    """What is known of the pad beforehand. A detector may use it; it must not lose a pad because of it."""


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
    corner_covariance_px2: NDArray[np.float64] | None = None
    """(8, 8), of x and y of the four corners one after the other, where the detector knows how their errors hang together."""


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
