"""OpenCV's detector for pads with markers inside markers.

It gives a marker up when it has read one inside it, so each level is looked for on its own, with a dictionary that holds nothing
but that level's markers.
"""

from collections.abc import Mapping
from dataclasses import replace

import cv2
import numpy as np

from alight.markers.family import dictionary
from alight.markers.layout import PadLayout, PlacedMarker
from alight.markers.pad_pose import mean_side_px
from schemas.settings.detector import Aruco
from services.detector.aruco import ArucoBackend
from services.detector.detector import FoundMarker, View, WantedMarker

LEAST_READABLE_PX = 9.0
"""A marker of fewer pixels a side is not looked for when a larger one, found, says how large it is."""
ENOUGH_PX = 30.0
"""Where a level shows a marker of so many pixels a side, the pad is located well, and the other levels need not be searched."""

MOST_OF_A_LEVEL = 6
"""More markers than that cost a frame more time than they add to the pose."""


class NestedAruco:
    """One backend for each family on each level, the undermost first."""

    name = "aruco"

    def __init__(self, layout: PadLayout, settings: Aruco) -> None:
        """Set one backend up for each level of the pad."""
        self._layout = layout
        self._searches = [
            LevelSearch(family, tuple(marker for marker in level if marker.family == family), settings)
            for level in layout.levels()
            for family in dict.fromkeys(marker.family for marker in level)
        ]
        self._last = self._searches[0]

    def detect(self, view: View) -> tuple[FoundMarker, ...]:
        """The pad's markers in one frame, beginning with the level that was enough in the last one; others are not looked for."""
        found: list[FoundMarker] = []
        for search in (self._last, *(each for each in self._searches if each is not self._last)):
            if self._readable_px(search.largest_m, found) < LEAST_READABLE_PX:
                continue
            more = search.detect(view)
            found.extend(more)
            if more and max(_side_px(marker) for marker in more) >= ENOUGH_PX:
                self._last = search
                break
        return tuple(found)

    def counters(self) -> Mapping[str, int]:
        """Those of all levels together."""
        total: dict[str, int] = {}
        for search in self._searches:
            for name, count in search.counters().items():
                total[name] = total.get(name, 0) + count
        return total

    def _readable_px(self, side_m: float, found: list[FoundMarker]) -> float:
        """How large a marker of that side must be in the picture; infinite if nothing tells."""
        for marker in found:
            placed = self._layout.find(marker.family, marker.id)
            if placed is not None:
                return side_m / placed.side_m * _side_px(marker)
        return np.inf


def _side_px(marker: FoundMarker) -> float:
    return mean_side_px([(x, y) for x, y in marker.corners_px.tolist()])


class LevelSearch:
    """Some markers of one family."""

    def __init__(
        self, family: str, markers: tuple[PlacedMarker, ...], settings: Aruco, *, most: int = MOST_OF_A_LEVEL
    ) -> None:
        """Set a backend up that knows no other markers than these, and gives at most so many of them."""
        codes = dictionary(family)
        self._numbers = [marker.id for marker in markers]
        few = cv2.aruco.Dictionary(
            np.ascontiguousarray(codes.bytesList[self._numbers]), codes.markerSize, codes.maxCorrectionBits
        )
        self.largest_m = max(marker.side_m for marker in markers)
        single = WantedMarker(family, 0) if len(markers) == 1 else None
        self._backend = ArucoBackend(few, family, settings, single, most)

    def detect(self, view: View) -> list[FoundMarker]:
        """Those in the frame."""
        return [replace(marker, id=self._numbers[marker.id]) for marker in self._backend.detect(view)]

    def counters(self) -> Mapping[str, int]:
        """The backend's."""
        return self._backend.counters()
