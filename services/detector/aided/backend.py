"""The backend `aided`: finds the pad by its known pattern, and by OpenCV's detector where that is quicker."""

import math
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from alight.geometry.rotation import R_from_quaternion
from alight.markers.layout import PadLayout
from services.detector.aided.alignment import Aligner, Alignment, Attempt
from services.detector.aided.guess import Guess
from services.detector.aided.level_view import LevelView, Region, level_view
from services.detector.aided.marker_view import MarkerView, TiltPrior, views_of_square
from services.detector.aided.noise import noise_level
from services.detector.aided.patience import Patience
from services.detector.aided.pattern import pattern_of
from services.detector.aided.pixel_rays import PixelRays
from services.detector.aided.places import Places
from services.detector.aided.round_guess import rounded
from services.detector.aided.search import BANK_SIDE_PX, SIZE_STEP, PatternSearch
from services.detector.aided.tracking import Track, shifted_to_match
from services.detector.aided.verification import is_marker, is_still_marker
from services.detector.detector import Detector, FoundMarker, Prior, Tally, View
from services.detector.edge_corners import Outline, RefinedCorners
from services.detector.sharp_corners import is_borne_out, sharp_corners
from services.detector.square_pose import square_points_m

Array = NDArray[np.float64]

_LEVEL_RATIO = 1.42
_UNKNOWN_SIDES_PX = tuple(BANK_SIDE_PX * _LEVEL_RATIO**level for level in range(5))
"""Larger markers OpenCV's detector misses where the edge of a shadow crosses them; to search a picture made that small takes little."""
_LARGEST_ENLARGING = 1.3
_PROPOSALS = 8
_SHADED_STEPS, _MORE_STEPS = 2, 8
_PROMISING = (0.68, 0.72, 0.75, 0.78)
"""How like the code the picture is at a proposal, and after each step. Of 300 pads from 8 m to 40 m all had 0.70, 0.74, 0.77 and 0.80 or more, of
places beside them or in clutter 36, 30, 27 and 20 percent have as much as is asked for here."""
_TRACK_STEPS, _LAST_STEPS = 2, 4
_LEAST_SCORE = 0.45
_HOPELESS, _HOPEFUL = 0.72, 0.85
_SECOND_THOUGHTS = 2
_SHADOW_NOISES = 1.5
_SHADOW_GAIN = 0.8
_UNKNOWN_TILT_RAD = math.radians(12.0)
_HIGH_SIGMAS = 2.0
_LEAST_TILT_RAD = math.radians(1.0)
_NOMINAL_FOCAL_WIDTHS = 0.9
_EDGES_FROM_SHRINK = 4
"""A fit to a picture made smaller than this by half or more errs by its pixels: by 0.05 px at 2 m, by 0.13 at 1 m. The marker's edges, followed in the picture
itself from where the fit has them, could be made out on all of 1200 rendered pads from 0.85 m to 5 m, right to 0.023 to 0.032 px (rms) by height."""
_LARGEST_CORRECTION_PX = 2.5
"""Between a coordinate of a corner by its edges and by the fit: beyond it the cells have to bear the edges out."""
_ALL_EXPLAINED = 0.9995
"""The code's likeness where nothing covers a marker: the corners of the fit are then not checked."""


class AidedBackend:
    """Looks for one pad."""

    name = "aided"

    def __init__(self, layout: PadLayout, whole_frame: Detector, places: Places | None = None) -> None:
        """Prepare the pattern.

        Args:
            layout: The pad.
            whole_frame: What finds large markers without any hint.
            places: What says where to look for the pattern where nothing is known; by default it is looked for everywhere.
        """
        self._layout = layout
        self._main = layout.markers[0]
        self._pattern = pattern_of(self._main, layout)
        self._search = PatternSearch(self._pattern)
        self._whole_frame = whole_frame
        self._places = places
        self.name = self.name if places is None else places.name
        self._camera: PinholeCamera | None = None
        self._aligner: Aligner | None = None
        self._track = Track()
        self._patience, self._contrary = Patience(), Patience()
        self._noise = 0.0
        self._tally = Tally({"tracked": 0, "pattern_searches": 0, "found_by_pattern": 0, "sharpened_by_edges": 0})

    def detect(self, view: View) -> tuple[FoundMarker, ...]:
        """The pad's markers, and whatever else a search of the whole frame has met."""
        aligner = self._aligner_for(view)
        tracked = self._tracked(view, aligner)
        if tracked is not None:
            self._tally.add("tracked")
            self._patience.found()
            return (self._found(view, tracked),)
        self._track.lost()
        self._noise = noise_level(view.picture)
        return self._sought(view, aligner)

    def _sought(self, view: View, aligner: Aligner) -> tuple[FoundMarker, ...]:
        """What is found without knowing where it was a moment ago: where and as large as is foretold, then by OpenCV, then anywhere."""
        prior, now_ns = view.prior, view.captured_at_ns
        least_side_px = _least_side_px(prior, aligner.camera, self._main.side_m)
        # Another of the pad's markers may fit: those are left to OpenCV's detector, which looks in every frame.
        fits = least_side_px <= min(view.picture.shape)
        anywhere = self._patience.allows(now_ns, explained=not fits)
        if prior is not None and self._is_worth_a_search(prior, anywhere, fits=fits):
            alignment = self._acquired(view, prior, aligner)
            if alignment is not None:
                return self._begun(view, alignment)
        if self._places is not None and anywhere:
            alignment = self._at_places(view, self._places, aligner)
            if alignment is not None:
                return self._begun(view, alignment)
        found = self._whole_frame.detect(view)
        if any(self._layout.find(marker.family, marker.id) for marker in found):
            self._patience.found()
            return tuple(self._sharpened(view, marker, aligner) for marker in found)
        contrary = least_side_px > _UNKNOWN_SIDES_PX[-1] * SIZE_STEP
        if not anywhere or self._places is not None:
            return found
        if contrary and not self._contrary.allows(now_ns, explained=True):
            return found
        # Height and place may be wrong: look once more without them.
        alignment = self._acquired(view, _attitude_of(prior), aligner)
        return (*found, *self._begun(view, alignment)) if alignment is not None else found

    def _begun(self, view: View, alignment: Alignment) -> tuple[FoundMarker, ...]:
        self._tally.add("found_by_pattern")
        self._patience.found()
        return (self._found(view, alignment),)

    def counters(self) -> Mapping[str, int]:
        """How the pad was found."""
        places = self._places.counters() if self._places is not None else {}
        return {**self._whole_frame.counters(), **self._tally.counts, **places}

    def _is_worth_a_search(self, prior: Prior, anywhere: bool, *, fits: bool) -> bool:
        if prior.height_m is None:
            return False
        if prior.centre_px is not None:
            return anywhere or fits
        return anywhere and self._places is None

    def _aligner_for(self, view: View) -> Aligner:
        height, width = view.picture.shape
        camera = view.camera or _nominal_camera(width, height)
        if self._aligner is None or camera != self._camera:
            self._camera = camera
            self._aligner = Aligner(self._pattern, self._main.side_m, PixelRays(camera))
        return self._aligner

    def _sharpened(self, view: View, marker: FoundMarker, aligner: Aligner) -> FoundMarker:
        """The pad's largest marker laid over the picture, where OpenCV's detector has found it; any other as it is."""
        if (marker.family, marker.id) != (self._main.family, self._main.id):
            return marker
        views = views_of_square(marker.corners_px, self._main.side_m, aligner.camera)
        alignment = self._confirmed(view, None, [Guess(each) for each in views], aligner, _tilt(view.prior))
        if alignment is None:
            return marker
        return self._found(view, alignment)

    def _acquired(self, view: View, prior: Prior | None, aligner: Aligner) -> Alignment | None:
        """The marker where, and as large as, the prior says, or anywhere and of any size small enough where it says nothing."""
        self._tally.add("pattern_searches")
        levels = _levels(prior, aligner.camera, self._main.side_m)
        return self._among(view, prior, aligner, [(scale, _region(prior, side_px)) for side_px, scale in levels])

    def _at_places(self, view: View, places: Places, aligner: Aligner) -> Alignment | None:
        """The marker where somebody else thinks that it may be. Its size there is no knowledge, and nothing is verified against it."""
        prior, camera = _attitude_of(view.prior), aligner.camera
        focal_px, normal_camera = (camera.fx_px + camera.fy_px) / 2.0, _tilt(prior).normal_camera
        areas: list[tuple[float, Region | None]] = []
        for place in places.places(view):
            side = place.side_at_unit_distance(camera, normal_camera)
            if side > 0.0:
                scale = min(BANK_SIDE_PX / (focal_px * side), _LARGEST_ENLARGING)
                areas.append((scale, Region(place.x_px, place.y_px, place.reach_px + place.side_px)))
        return self._among(view, prior, aligner, areas)

    def _among(
        self, view: View, prior: Prior | None, aligner: Aligner, areas: list[tuple[float, Region | None]]
    ) -> Alignment | None:
        """The marker in one of the areas, each looked at with its scale."""
        tilt = _tilt(prior)
        levels: list[LevelView] = []
        for scale, region in areas:
            level = level_view(view.picture, aligner.rays, tilt.normal_camera, scale, region)
            if level is not None:
                levels.append(level)
        if not levels:
            return None
        proposals = self._search.proposals([level.picture for level in levels], _PROPOSALS)
        likely = [each for each in proposals if each.score >= _LEAST_SCORE]
        guesses = (Guess(levels[each.picture].marker_view(each, self._main.side_m)) for each in likely)
        return self._confirmed(view, prior, guesses, aligner, tilt)

    def _confirmed(
        self, view: View, prior: Prior | None, guesses: Iterable[Guess], aligner: Aligner, tilt: TiltPrior
    ) -> Alignment | None:
        """The first of the guesses, the likeliest tried first, that turns out to be the marker."""
        hopeful: list[Attempt] = []
        for guess in guesses:
            first = aligner.attempted(view.picture, guess, tilt, _PROMISING)
            if first is None or first.code_likeness(self._noise) < _HOPELESS:
                continue
            if first.code_likeness(self._noise) >= _HOPEFUL:
                alignment = self._settled(view, prior, first, aligner, tilt)
                if alignment is not None:
                    return alignment
            else:
                hopeful.append(first)
        for first in sorted(hopeful, key=lambda each: -each.code_likeness(self._noise))[:_SECOND_THOUGHTS]:
            alignment = self._settled(view, prior, first, aligner, tilt)
            if alignment is not None:
                return alignment
        return None

    def _settled(
        self, view: View, prior: Prior | None, first: Attempt, aligner: Aligner, tilt: TiltPrior
    ) -> Alignment | None:
        """The fit gone on with, if needed with the edge of a shadow; None if it does not show the marker."""
        fit = self._shaded(view, first, aligner, tilt) or self._ended(view, first.guess, aligner, tilt)
        return fit if fit is not None and is_marker(fit, aligner, self._noise, tilt, prior) else None

    def _shaded(self, view: View, first: Attempt, aligner: Aligner, tilt: TiltPrior) -> Alignment | None:
        """The fit gone on with the edge of a shadow across it; None if none explains the picture much better."""
        if first.residual <= _SHADOW_NOISES * self._noise:
            return None
        begin = aligner.shaded(first)
        about = aligner.improved(view.picture, begin, tilt, _SHADED_STEPS) if begin is not None else None
        fit = self._ended(view, about, aligner, tilt) if about is not None else None
        return fit if fit is not None and fit.residual < _SHADOW_GAIN * first.residual else None

    def _tracked(self, view: View, aligner: Aligner) -> Alignment | None:
        """The marker where it should be after the last frame."""
        predicted = self._track.predicted(view)
        if predicted is None:
            return None
        tilt = _tilt(view.prior)
        alignment = self._followed(view, predicted, aligner, tilt)
        if alignment is not None:
            return alignment
        guess = shifted_to_match(view.picture, aligner, predicted)
        if guess is None:
            return None
        alignment = self._followed(view, guess, aligner, tilt)
        if alignment is not None:
            return alignment
        return self._confirmed(view, None, [guess], aligner, tilt)

    def _followed(self, view: View, guess: Guess, aligner: Aligner, tilt: TiltPrior) -> Alignment | None:
        """The fit from a guess that is nearly right; None if it is not."""
        about = aligner.improved(view.picture, guess, tilt, _TRACK_STEPS)
        if about is None:
            return None
        alignment = aligner.fitted(view.picture, rounded(about, aligner.cell_m), tilt, _LAST_STEPS)
        return alignment if alignment is not None and is_still_marker(alignment, self._noise, tilt) else None

    @staticmethod
    def _ended(view: View, guess: Guess, aligner: Aligner, tilt: TiltPrior) -> Alignment | None:
        """A fit gone through to its end from a rounded beginning."""
        return aligner.fitted(view.picture, rounded(guess, aligner.cell_m), tilt, _MORE_STEPS)

    def _found(self, view: View, alignment: Alignment) -> FoundMarker:
        """The main marker, which is remembered."""
        self._track.seen(view, alignment.guess)
        family, number = self._main.family, self._main.id
        sharper = self._sharper(view, alignment)
        if sharper is not None:
            self._tally.add("sharpened_by_edges")
            return FoundMarker(family, number, sharper.corners_px, sharper.sigma_px, sharper.covariance_px2)
        sigma_px, covariance = alignment.corner_sigma_px, alignment.corner_covariance_px2
        return FoundMarker(family, number, alignment.corners_px, sigma_px, covariance)

    def _sharper(self, view: View, alignment: Alignment) -> RefinedCorners | None:
        """The corners by edges and cells where they are surer than the fit, or the cells contradict it; else None."""
        sharp = self._sharp(view, alignment) if alignment.patch.shrink >= _EDGES_FROM_SHRINK else None
        if sharp is not None and sharp.sigma_px < alignment.corner_sigma_px:
            near = float(np.abs(sharp.corners_px - alignment.corners_px).max()) <= _LARGEST_CORRECTION_PX
            if near or self._borne_out(view, sharp):
                return sharp
        if alignment.code_likeness(self._noise) >= _ALL_EXPLAINED:
            return None
        fit = RefinedCorners(
            alignment.corners_px,
            alignment.corner_covariance_px2,
            Outline(alignment.corners_px, _straight(alignment.view, self._main.side_m)),
        )
        if self._borne_out(view, fit) is not False:
            return None
        return sharp or self._sharp(view, alignment)

    def _borne_out(self, view: View, corners: RefinedCorners) -> bool | None:
        return is_borne_out(view.picture, corners, self._pattern.count, view.camera)

    def _sharp(self, view: View, alignment: Alignment) -> RefinedCorners | None:
        return sharp_corners(view.picture, alignment.corners_px, self._pattern.count, view.camera)


def _tilt(prior: Prior | None) -> TiltPrior:
    if prior is None or prior.q_ned_camera is None:
        return TiltPrior(np.array((0.0, 0.0, -1.0)), _UNKNOWN_TILT_RAD)
    up_camera = -R_from_quaternion(prior.q_ned_camera)[2]
    return TiltPrior(up_camera, max(prior.attitude_sigma_rad, _LEAST_TILT_RAD))


def _attitude_of(prior: Prior | None) -> Prior | None:
    if prior is None or prior.q_ned_camera is None:
        return None
    return Prior(q_ned_camera=prior.q_ned_camera, attitude_sigma_rad=prior.attitude_sigma_rad)


def _straight(view: MarkerView, side_m: float) -> Array:
    """The corners before the lens, x/z and y/z, (4, 2)."""
    at = square_points_m(side_m) @ view.R.T + view.t
    return np.asarray(at[:, :2] / at[:, 2:], float)


def _least_side_px(prior: Prior | None, camera: PinholeCamera, side_m: float) -> float:
    """How small the marker is at most, for all that is known: the length of its sides from as high as may be, pixels."""
    if prior is None:
        return 0.0
    highest_m = prior.height_at_most_m
    if prior.height_m is not None:
        highest_m = prior.height_m + _HIGH_SIGMAS * prior.height_sigma_m
    return camera.fx_px * side_m / highest_m if highest_m is not None and highest_m > 0.0 else 0.0


def _levels(prior: Prior | None, camera: PinholeCamera, side_m: float) -> list[tuple[float, float]]:
    """For each search the side of the marker that it is for, pixels, and the scale of its picture."""
    focal_px = (camera.fx_px + camera.fy_px) / 2.0
    if prior is None or prior.height_m is None or prior.height_m <= 0.0:
        return [(side_px, BANK_SIDE_PX / side_px) for side_px in _UNKNOWN_SIDES_PX]
    spread = math.log1p(2.0 * prior.height_sigma_m / prior.height_m) if prior.q_ned_camera else math.log(1.25)
    count = max(math.ceil(2.0 * spread / math.log(_LEVEL_RATIO)), 1)
    middle_px = focal_px * side_m / prior.height_m
    sides = [middle_px * _LEVEL_RATIO ** (number - (count - 1) / 2.0) for number in range(count)]
    return [(side, min(BANK_SIDE_PX / side, _LARGEST_ENLARGING)) for side in sides]


def _region(prior: Prior | None, side_px: float) -> Region | None:
    if prior is None or prior.centre_px is None:
        return None
    return Region(*prior.centre_px, 3.0 * prior.centre_sigma_px + 1.5 * side_px)


def _nominal_camera(width_px: int, height_px: int) -> PinholeCamera:
    """A camera to compute with where none is known: what is found is then exact only in the picture, not in space."""
    focal_px = _NOMINAL_FOCAL_WIDTHS * width_px
    return PinholeCamera(width_px, height_px, focal_px, focal_px, (width_px - 1) / 2.0, (height_px - 1) / 2.0)
