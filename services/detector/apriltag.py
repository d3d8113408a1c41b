"""The backend `apriltag`: the AprilTag 3 library through `pyapriltags`, for markers of AprilTag families."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyapriltags
from numpy.typing import NDArray

from alight.markers.family import FamilyError, dictionary
from schemas.settings.detector import AprilTag
from services.detector.detector import FoundMarker, Tally, View
from services.detector.pattern_check import PatternCheck, is_dense
from services.detector.quadrilateral import is_sound
from services.detector.sharp_corners import sharp_corners

LIBRARY_NAMES: Mapping[str, str] = {
    "apriltag_16h5": "tag16h5",
    "apriltag_25h9": "tag25h9",
    "apriltag_36h11": "tag36h11",
}
"""Families that both OpenCV, which prints and renders them, and the library know: our name to the library's."""

_CENTRE_OF_FIRST_PIXEL = 0.5
"""The library counts from the upper left pixel's corner, everything here from its centre."""
_CORNER_SIGMA_PX = 0.15
"""Standard deviation of a corner coordinate as the library gives it, measured on rendered pads from 1.5 m to 22 m."""
_FROM_LIBRARY = (1, 0, 3, 2)
"""The library begins at the upper right corner of the print as OpenCV draws it and goes round the other way."""


class AprilTagBackend:
    """Finds all markers of some families; it remembers nothing."""

    name = "apriltag"

    def __init__(self, families: Sequence[str], settings: AprilTag) -> None:
        """Set the library up.

        Args:
            families: AprilTag families to look for.
            settings: Parameters of the search.

        Raises:
            FamilyError: If the library does not know a family.
            OSError: If the library cannot be loaded on this machine.
        """
        unknown = [family for family in families if family not in LIBRARY_NAMES]
        if unknown:
            raise FamilyError(
                f"the detector apriltag reads {', '.join(LIBRARY_NAMES)}, not {unknown[0]}: take aided or aruco"
            )
        self._settings = settings
        self._families = {LIBRARY_NAMES[family]: family for family in families}
        codes = {family: dictionary(family) for family in families}
        self._cells = {family: each.markerSize + 2 for family, each in codes.items()}
        self._checks = {family: PatternCheck(each) for family, each in codes.items() if is_dense(each)}
        self._library = pyapriltags.Detector(
            families=" ".join(self._families), quad_decimate=settings.decimate, quad_sigma=settings.blur_sigma_px
        )
        # The binding's own argument for it is cut to a whole number.
        created: Any = self._library.tag_detector_ptr
        created.contents.decode_sharpening = settings.sharpening
        self._tally = Tally({"doubtful_codes_refused": 0, "look_alikes_refused": 0})

    def detect(self, view: View) -> tuple[FoundMarker, ...]:
        """The markers in the whole frame."""
        markers = (self._marker(view, each) for each in self._library.detect(view.picture))
        return tuple(marker for marker in markers if marker is not None)

    def counters(self) -> Mapping[str, int]:
        """What was read and not believed."""
        return self._tally.counts

    def _marker(self, view: View, read: pyapriltags.Detection) -> FoundMarker | None:
        if read.hamming > self._settings.most_wrong_bits or read.decision_margin < self._settings.least_margin:
            self._tally.add("doubtful_codes_refused")
            return None
        family = self._families[read.tag_family.decode()]
        corners = np.asarray(read.corners, float)[list(_FROM_LIBRARY)] - _CENTRE_OF_FIRST_PIXEL
        if not is_sound(corners):
            return None
        if family in self._checks and not self._checks[family].agrees(view.picture, corners, read.tag_id):
            self._tally.add("look_alikes_refused")
            return None
        return self._refined(view, family, read.tag_id, corners)

    def _refined(self, view: View, family: str, number: int, corners: NDArray[np.float64]) -> FoundMarker:
        if self._settings.refine_edges:
            sharper = sharp_corners(view.picture, corners, self._cells[family], view.camera)
            if sharper is not None and is_sound(sharper.corners_px):
                return FoundMarker(family, number, sharper.corners_px, sharper.sigma_px)
        return FoundMarker(family, number, corners, _CORNER_SIGMA_PX)
