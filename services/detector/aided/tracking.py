"""Following the pad from frame to frame."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.rotation import R_from_quaternion
from schemas.message import Quaternion
from services.detector.aided.alignment import Aligner
from services.detector.aided.guess import Guess
from services.detector.aided.marker_view import MarkerView
from services.detector.detector import GreyPicture, View

Array = NDArray[np.float64]

_LARGEST_GAP_NS = 500_000_000
_COARSE_SIDE_PX = 14.0
_MARGIN_SIDES = 0.6
_LEAST_MARGIN_PX = 6.0
_LEAST_MATCH = 0.5


@dataclass(frozen=True)
class _Sighting:
    at_ns: int
    guess: Guess
    q_ned_camera: Quaternion | None


class Track:
    """Where a marker was in the last frames, and where it will be."""

    def __init__(self) -> None:
        self._last: _Sighting | None = None
        self._velocity_per_ns: Array = np.zeros(3)
        """Of the marker against the camera, NED where attitudes are known, else camera frame; metres a nanosecond."""

    def seen(self, view: View, guess: Guess) -> None:
        """The marker is here."""
        q = view.prior.q_ned_camera if view.prior is not None else None
        new = _Sighting(view.captured_at_ns, guess, q)
        self._velocity_per_ns = np.zeros(3)
        if self._last is not None and (self._last.q_ned_camera is None) == (q is None):
            elapsed_ns = new.at_ns - self._last.at_ns
            if 0 < elapsed_ns <= _LARGEST_GAP_NS:
                self._velocity_per_ns = (_outer(new) - _outer(self._last)) / elapsed_ns
        self._last = new

    def lost(self) -> None:
        """The marker is not to be seen."""
        self._last = None

    def predicted(self, view: View) -> Guess | None:
        """Where it should be in a frame; None if it was not in the last one or that was too long ago."""
        last = self._last
        if last is None or not 0 < view.captured_at_ns - last.at_ns <= _LARGEST_GAP_NS:
            return None
        moved = self._velocity_per_ns * (view.captured_at_ns - last.at_ns)
        q = view.prior.q_ned_camera if view.prior is not None else None
        before = last.guess.view
        if last.q_ned_camera is None or q is None:
            t = before.t + (moved if last.q_ned_camera is None else 0.0)
            R = before.R
        else:
            R_before, R_now = R_from_quaternion(last.q_ned_camera), R_from_quaternion(q)
            t = R_now.T @ (R_before @ before.t + moved)
            R = R_now.T @ R_before @ before.R
        return Guess(MarkerView(R, t), last.guess.blur, last.guess.edge) if t[2] > 0.0 else None


def _outer(sighting: _Sighting) -> Array:
    t = sighting.guess.view.t
    return t if sighting.q_ned_camera is None else np.asarray(R_from_quaternion(sighting.q_ned_camera) @ t)


def shifted_to_match(picture: GreyPicture, aligner: Aligner, guess: Guess) -> Guess | None:
    """Move a predicted marker sideways to where it correlates best with the picture; None where nothing correlates."""
    corners = aligner.corners_px(guess.view)
    if not np.isfinite(corners).all():
        return None
    side_px = float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).mean())
    shrink = 1 << max(math.ceil(math.log2(max(side_px, 1.0) / _COARSE_SIDE_PX)), 0)
    margin = math.ceil(max(_MARGIN_SIDES * side_px / shrink, _LEAST_MARGIN_PX))
    quiet_px = side_px / aligner.pattern.count
    size = np.array(picture.shape[::-1]) // shrink
    # All from here on in pixels of the smaller picture.
    low = np.maximum(np.floor((corners.min(axis=0) - quiet_px) / shrink).astype(int), 0)
    high = np.minimum(np.ceil((corners.max(axis=0) + quiet_px) / shrink).astype(int) + 1, size)
    if int((high - low).min()) < 4:
        return None
    first, last = np.maximum(low - margin, 0), np.minimum(high + margin, size)
    (left, top), (right, bottom) = (first * shrink).tolist(), (last * shrink).tolist()
    part = picture[top:bottom, left:right]
    if shrink > 1:
        columns, rows = (last - first).tolist()
        part = np.asarray(cv2.resize(part, (columns, rows), interpolation=cv2.INTER_AREA), np.uint8)
    x0, y0, wide, tall = np.concatenate((low, high - low)).tolist()
    template = aligner.rendered(guess, x0, y0, wide, tall, shrink)
    if template is None:
        return None
    match = cv2.matchTemplate(part, template, cv2.TM_CCOEFF_NORMED)
    _, best, _, (x, y) = cv2.minMaxLoc(match)
    if not best >= _LEAST_MATCH:
        return None
    shift = (first + np.array((x, y)) - low) * shrink
    middle = corners.mean(axis=0)
    rays = aligner.camera.undistorted(np.array((middle, middle + shift)))
    moved = guess.view.t + np.append((rays[1] - rays[0]) * guess.view.t[2], 0.0)
    return Guess(MarkerView(guess.view.R, moved), guess.blur, guess.edge) if np.isfinite(moved).all() else None
