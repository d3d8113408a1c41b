"""The backend `aruco`: OpenCV's detector of square markers, with sharper corners and a search window for the pad."""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from schemas.settings.detector import Aruco
from services.detector.cell_corners import cells_tell
from services.detector.detector import FoundMarker, GreyPicture, Tally, View, WantedMarker
from services.detector.pattern_check import PatternCheck, is_dense
from services.detector.quadrilateral import is_sound
from services.detector.search_window import SearchWindow, Window
from services.detector.sharp_corners import sharp_corners
from services.detector.thinning import thinned

CONTOUR_INSET_PX = 0.5
"""A contour runs through the centres of the outermost dark pixels, so it lies this much inside the edge."""
CONTOUR_SIGMA_PX = 0.35
"""Standard deviation of a corner coordinate that comes from a contour, measured on rendered pads from 1 m to 20 m."""
_UNSEEN_SIGMA_CELLS = 0.25
"""The same in cells, of a marker neither whose edges nor whose cells can be made out."""

SHADE_CAP = 0.45
"""In the second look everything brighter than this part of the brightest is as bright: white paper in the shade then looks like white
paper in the sun, and the edge of the shadow over it is gone. In a photograph shade halves the levels or so; ink has an eighth."""
_BRIGHTEST_PERCENTILE = 99.0
_THRESHOLD_CELLS = 1.0
_LEAST_THRESHOLD_PX = 2.0
_MOST_THRESHOLD_PX = 11.0
_LEAST_PERIMETER = 0.5


class ArucoBackend:
    """Finds the markers of one dictionary."""

    name = "aruco"

    def __init__(
        self,
        dictionary: cv2.aruco.Dictionary,
        family: str,
        settings: Aruco,
        wanted: WantedMarker | None = None,
        most: int | None = None,
    ) -> None:
        """Set OpenCV's detector up.

        Args:
            dictionary: The markers to look for.
            family: Its name, for the messages.
            settings: Parameters of the search.
            wanted: The pad, whose place in the last frame is searched first; None searches whole frames.
            most: How many markers of a frame to sharpen and give, should there be more; None for all.
        """
        parameters = _parameters(settings)
        parameters.adaptiveThreshWinSizeMin = settings.threshold_window_min_px
        parameters.adaptiveThreshWinSizeMax = settings.threshold_window_max_px
        parameters.adaptiveThreshWinSizeStep = settings.threshold_window_step_px
        self._settings = settings
        self._opencv = cv2.aruco.ArucoDetector(dictionary, parameters)
        self._in_window_opencv = cv2.aruco.ArucoDetector(dictionary, _parameters(settings))
        self._family, self._refine = family, settings.refine_edges
        self._cells = dictionary.markerSize + 2
        self._pattern_check = PatternCheck(dictionary) if is_dense(dictionary) else None
        self._wanted = wanted if settings.track else None
        self._most = most
        self._window = SearchWindow()
        self._tally = Tally(
            {
                "found_in_window": 0,
                "missed_in_window": 0,
                "whole_frame_searches": 0,
                "found_in_shade": 0,
                "look_alikes_refused": 0,
            }
        )

    def detect(self, view: View) -> tuple[FoundMarker, ...]:
        """The markers in the window where the pad should be, if it is there, else those in the whole frame."""
        if self._wanted is None:
            return self._whole_frame(view)
        height, width = view.picture.shape
        window = self._window.predicted(view.captured_at_ns, width, height)
        if window is not None:
            markers = self._in_window(view, window)
            if self._follow(markers, view.captured_at_ns):
                self._tally.add("found_in_window")
                return markers
            self._tally.add("missed_in_window")
        markers = self._whole_frame(view)
        if not self._follow(markers, view.captured_at_ns):
            self._window.lost()
        return markers

    def counters(self) -> Mapping[str, int]:
        """How often the window was enough."""
        return self._tally.counts

    def _follow(self, markers: tuple[FoundMarker, ...], at_ns: int) -> bool:
        pad = next((marker for marker in markers if self._wanted and marker.id == self._wanted.id), None)
        if pad is None:
            return False
        self._window.seen(pad.corners_px, at_ns)
        return True

    def _whole_frame(self, view: View) -> tuple[FoundMarker, ...]:
        """Without the pad, once more with the bright parts levelled: a shadow's edge across a marker breaks its outline."""
        self._tally.add("whole_frame_searches")
        markers = self._markers(view, _search(self._opencv, view.picture), 1)
        if self._wanted is None or self._shows_pad(markers):
            return markers
        shaded = self._markers(view, _search(self._opencv, _levelled(view.picture)), 1)
        if not self._shows_pad(shaded):
            return markers
        self._tally.add("found_in_shade")
        known = {marker.id for marker in markers}
        return (*markers, *(marker for marker in shaded if marker.id not in known))

    def _shows_pad(self, markers: tuple[FoundMarker, ...]) -> bool:
        return any(self._wanted is not None and marker.id == self._wanted.id for marker in markers)

    def _in_window(self, view: View, window: Window) -> tuple[FoundMarker, ...]:
        part = view.picture[window.top : window.bottom, window.left : window.right]
        if window.shrink > 1:
            size = (max(part.shape[1] // window.shrink, 1), max(part.shape[0] // window.shrink, 1))
            used = part[: size[1] * window.shrink, : size[0] * window.shrink]
            part = np.asarray(cv2.resize(used, size, interpolation=cv2.INTER_AREA), np.uint8)
        origin = np.array((window.left, window.top))
        self._in_window_opencv.setDetectorParameters(
            _fitted_parameters(self._settings, self._cells, window, max(part.shape))
        )
        # A pixel of the smaller picture has its centre in the middle of those it was made of.
        found = [
            (number, (corners + 0.5) * window.shrink - 0.5 + origin)
            for number, corners in _search(self._in_window_opencv, np.ascontiguousarray(part))
        ]
        return self._markers(view, found, window.shrink)

    def _markers(
        self, view: View, found: list[tuple[int, NDArray[np.float64]]], shrink: int
    ) -> tuple[FoundMarker, ...]:
        sound = [(number, corners) for number, corners in found if is_sound(corners)]
        markers = (
            self._refined(view, number, _outset(corners, CONTOUR_INSET_PX * shrink), shrink)
            for number, corners in (sound if self._most is None else thinned(sound, self._most))
        )
        return tuple(marker for marker in markers if self._is_there(view, marker))

    def _is_there(self, view: View, marker: FoundMarker) -> bool:
        if self._pattern_check is None or self._pattern_check.agrees(view.picture, marker.corners_px, marker.id):
            return True
        self._tally.add("look_alikes_refused")
        return False

    def _refined(self, view: View, number: int, corners: NDArray[np.float64], shrink: int) -> FoundMarker:
        sharper = sharp_corners(view.picture, corners, self._cells, view.camera) if self._refine else None
        if sharper is None or not is_sound(sharper.corners_px):
            return FoundMarker(self._family, number, corners, self._contour_sigma_px(corners, shrink))
        return FoundMarker(self._family, number, sharper.corners_px, sharper.sigma_px)

    def _contour_sigma_px(self, corners: NDArray[np.float64], shrink: int) -> float:
        """Larger where edges and cells are large enough to be seen and are not: something may have cut the contour, or drawn it out."""
        sigma_px = CONTOUR_SIGMA_PX * shrink
        if not (self._refine and cells_tell(corners, self._cells)):
            return sigma_px
        side_px = float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).mean())
        return max(sigma_px, _UNSEEN_SIGMA_CELLS * side_px / self._cells)


def _search(opencv: cv2.aruco.ArucoDetector, picture: GreyPicture) -> list[tuple[int, NDArray[np.float64]]]:
    corners, ids, _ = opencv.detectMarkers(picture)
    if ids is None:
        return []
    return [
        (int(number), np.asarray(four, float).reshape(4, 2))
        for number, four in zip(np.ravel(ids), corners, strict=True)
    ]


def _levelled(picture: GreyPicture) -> GreyPicture:
    """The picture with everything bright equally bright, see `SHADE_CAP`."""
    cap = SHADE_CAP * float(np.percentile(picture[::4, ::4], _BRIGHTEST_PERCENTILE))
    return np.minimum(picture, np.uint8(cap))


def _outset(corners: NDArray[np.float64], distance_px: float) -> NDArray[np.float64]:
    """The corners after every edge has moved outward."""
    edges = np.roll(corners, -1, axis=0) - corners
    edges /= np.linalg.norm(edges, axis=1, keepdims=True)
    before = np.roll(edges, 1, axis=0)
    sine = np.abs(before[:, 0] * edges[:, 1] - before[:, 1] * edges[:, 0])
    moved: NDArray[np.float64] = corners + distance_px * (before - edges) / np.maximum(sine, 0.2)[:, None]
    return moved


def _parameters(settings: Aruco) -> cv2.aruco.DetectorParameters:
    parameters = cv2.aruco.DetectorParameters()
    parameters.perspectiveRemovePixelPerCell = settings.cell_px
    parameters.perspectiveRemoveIgnoredMarginPerCell = settings.cell_margin
    return parameters


def _fitted_parameters(settings: Aruco, cells: int, window: Window, extent_px: int) -> cv2.aruco.DetectorParameters:
    """For a marker whose size is known: one threshold instead of three, and nothing much smaller."""
    side_px = window.side_px / window.shrink
    parameters = _parameters(settings)
    threshold_px = 2 * round(min(max(_THRESHOLD_CELLS * side_px / cells, _LEAST_THRESHOLD_PX), _MOST_THRESHOLD_PX)) + 1
    parameters.adaptiveThreshWinSizeMin = parameters.adaptiveThreshWinSizeMax = threshold_px
    parameters.minMarkerPerimeterRate = _LEAST_PERIMETER * 4.0 * side_px / extent_px
    return parameters
