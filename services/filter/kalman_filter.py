"""`kalman` and `moving`: one track that steers, and a challenger made of the fixes that it refuses."""

import math
import sys
from collections import Counter, deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alight.runtime.clock import nanoseconds
from schemas.fix import FixVerdict, PadFix
from schemas.fusion import FusionVerdict
from schemas.message import Vector3
from schemas.settings.filter import FilterMethod
from schemas.vehicle import VehicleState
from services.filter.attempt import Attempt, Filtered
from services.filter.navigation_frame import NavigationFrame
from services.filter.pad_motion import PadMotion
from services.filter.pad_track import Innovation, PadTrack
from services.filter.restlessness import Restlessness
from services.filter.sighting import Sighting, sighting_of

Array = NDArray[np.float64]

_FAR_M = 1000.0
"""A frame anchored farther away than this is left for a new one: there, north differs by a hundredth of a degree."""
_REMEMBER_NS = nanoseconds(1.0)
_MOST_REMEMBERED = 64


class _Step(NamedTuple):
    """What a fix that comes late has to be put before."""

    before: PadTrack
    sighting: Sighting


class KalmanFilter:
    """Fuses each fix at its capture time and gives the pad's place in the navigation solution of now.

    A fix that is not expected is left out (gate on the normalised innovation squared). If the refused ones agree with each
    other, more than `recover_fixes` in a row, it is the estimate that is wrong, and they take its place. Without fixes the
    track coasts: nothing leaves, and the next fix is judged by what has become of its uncertainty.
    """

    def __init__(self, settings: FilterMethod) -> None:
        self._settings = settings
        self._kalman = settings.kalman
        self._limit = settings.gate.sigma**2 or sys.float_info.max
        self._motion = PadMotion(settings.kalman, moving=settings.method == "moving")
        self._frame: NavigationFrame | None = None
        self._track: PadTrack | None = None
        self._challenger: PadTrack | None = None
        self._restlessness = Restlessness(self._kalman.restless_m)
        self._fused_ns = 0
        self._past: deque[_Step] = deque(maxlen=_MOST_REMEMBERED)
        self._counters: Counter[str] = Counter()

    def counters(self) -> dict[str, int]:
        """See `PadFilter.counters`."""
        return dict(self._counters)

    def take_vehicle(self, state: VehicleState) -> None:
        """See `PadFilter.take_vehicle`."""
        jump = None if self._frame is None else self._frame.take(state)
        if jump is None:
            return
        self._counters["navigation_jumps"] += 1
        self._past.clear()
        for track in (self._track, self._challenger):
            if track is not None:
                track.blur(self._kalman.jump_sigma_m)

    def take_fix(self, fix: PadFix) -> Attempt:
        """See `PadFilter.take_fix`."""
        if fix.verdict is not FixVerdict.ACCEPTED:
            return self._left_out("fix_not_accepted", FusionVerdict.NOT_ACCEPTED)
        if fix.corrected is None or fix.vehicle_position is None:
            return self._left_out("fix_incomplete", FusionVerdict.INCOMPLETE)
        if self._frame is None:
            self._frame = NavigationFrame(self._kalman, fix.corrected.position)
        sighting = sighting_of(fix, self._frame, self._settings)
        if sighting is None:
            return self._left_out("fix_incomplete", FusionVerdict.INCOMPLETE)
        if self._track is not None and fix.captured_at_ns <= self._track.at_ns:
            return self._fuse_late(sighting)
        return self._judge(sighting)

    def coasted(self) -> Filtered | None:
        """See `PadFilter.coasted`."""
        frame, track = self._frame, self._track
        vehicle = None if frame is None else frame.newest
        if frame is None or track is None or vehicle is None or not self._is_confirmed(track):
            return None
        if vehicle.at_ns <= track.at_ns:
            return None
        place, covariance, azimuth_variance = track.place_at(vehicle.at_ns)
        try:
            position = frame.in_solution(_vector(place), vehicle.at_ns)
        except ValueError:
            return None
        here = frame.continuous(vehicle.position, vehicle.at_ns)
        return Filtered(
            position=position,
            pad_ned_m=_vector(place - here),
            azimuth_rad=track.azimuth_rad,
            covariance_ned_m2=covariance + track.quick_m2 * np.eye(3),
            azimuth_variance_rad2=azimuth_variance,
            fixes_used=track.fixes,
            velocity_ned_mps=track.drift_mps,
            velocity_covariance_ned=track.drift_covariance,
            position_at_ns=vehicle.at_ns,
        )

    def _judge(self, sighting: Sighting) -> Attempt:
        track = self._track
        if track is None:
            return self._start(sighting)
        before = track.copy()
        track.predict(sighting.captured_at_ns)
        if not self._is_worth_keeping(track):
            self._counters["reset_uncertain"] += 1
            return self._start(sighting)
        innovation = self._learnt(track, sighting, track.innovation(sighting))
        if not innovation.nis <= self._limit:
            track.learn(innovation)
            return self._challenge(sighting, innovation)
        self._challenger = None
        self._remember(before, sighting)
        attempt = self._fuse(track, sighting, innovation)
        track.learn(innovation)
        self._keep_near()
        return attempt

    def _learnt(self, track: PadTrack, sighting: Sighting, innovation: Innovation) -> Innovation:
        """What a sighting says of how fast the solution walks; the innovation anew where it has walked faster since the last fusion."""
        since_s = max(0.0, (sighting.captured_at_ns - self._fused_ns) * 1e-9)
        self._restlessness.take(innovation.away_m, sum(innovation.variances_m2), since_s)
        more = self._restlessness.walk_m2ps - track.walk_m2ps
        track.walk_m2ps += more
        if more <= 0.0:
            return innovation
        self._counters["walk_learnt"] += 1
        track.blur(math.sqrt(more * since_s))
        return track.innovation(sighting)

    def _fuse(self, track: PadTrack, sighting: Sighting, innovation: Innovation) -> Attempt:
        correction, covariance = track.fuse(sighting, innovation)
        self._fused_ns = sighting.captured_at_ns
        self._counters["fix_used"] += 1
        if not self._is_confirmed(track):
            return _attempt(FusionVerdict.STARTED, innovation)
        return _attempt(FusionVerdict.FUSED, innovation, self._estimate(track, sighting, correction, covariance))

    def _estimate(self, track: PadTrack, sighting: Sighting, correction: Vector3, covariance: Array) -> Filtered | None:
        """The place in the solution of the newest vehicle state; the vector as it was at capture time."""
        assert self._frame is not None
        vehicle = self._frame.newest
        now_ns = sighting.captured_at_ns if vehicle is None else max(vehicle.at_ns, sighting.captured_at_ns)
        soon = track.soon_m((now_ns - sighting.captured_at_ns) * 1e-9)
        try:
            position = self._frame.in_solution(soon, now_ns)
        except ValueError:
            self._counters["reset_no_place"] += 1
            self._forget()
            return None
        self._counters["released"] += 1
        (n, e, d), (more_n, more_e, more_d) = sighting.pad_ned_m, correction
        return Filtered(
            position=position,
            pad_ned_m=(n + more_n, e + more_e, d + more_d),
            azimuth_rad=track.azimuth_rad,
            covariance_ned_m2=covariance,
            azimuth_variance_rad2=track.azimuth_variance_rad2,
            fixes_used=track.fixes,
            velocity_ned_mps=track.drift_mps,
            velocity_covariance_ned=track.drift_covariance,
            position_at_ns=now_ns,
        )

    def _start(self, sighting: Sighting) -> Attempt:
        self._track = PadTrack(sighting, self._kalman, self._motion)
        self._track.walk_m2ps = self._restlessness.walk_m2ps
        self._fused_ns = sighting.captured_at_ns
        self._challenger = None
        self._past.clear()
        self._counters["fix_used"] += 1
        return Attempt(FusionVerdict.STARTED)

    def _challenge(self, sighting: Sighting, refused: Innovation) -> Attempt:
        """Let the refused fixes make a track of their own; it wins when enough of them agree."""
        rival = self._challenger
        agreed = False
        if rival is not None:
            rival.predict(sighting.captured_at_ns)
            innovation = rival.innovation(sighting)
            agreed = innovation.nis <= self._limit
            if agreed:
                rival.fuse(sighting, innovation)
        if rival is None or not agreed:
            rival = PadTrack(sighting, self._kalman, self._motion)
        rival.walk_m2ps = self._restlessness.walk_m2ps
        self._challenger = rival
        wanted = self._kalman.recover_fixes
        if self._track is not None and not self._is_confirmed(self._track):
            wanted = self._kalman.confirm_fixes
        self._counters["fix_outlier"] += 1
        if rival.fixes < wanted:
            return _attempt(FusionVerdict.OUTLIER, refused)
        self._track, self._challenger = rival, None
        self._fused_ns = sighting.captured_at_ns
        self._past.clear()
        self._counters["reset_outvoted"] += 1
        return _attempt(FusionVerdict.REINITIALISED, refused)

    def _fuse_late(self, sighting: Sighting) -> Attempt:
        """A fix that was captured before one that is in already: go back to before that, and fuse them in order."""
        later = [step for step in self._past if step.sighting.captured_at_ns >= sighting.captured_at_ns]
        known = any(step.sighting.captured_at_ns == sighting.captured_at_ns for step in later)
        if not later or known or later[0].before.at_ns > sighting.captured_at_ns:
            return self._left_out("fix_out_of_order", FusionVerdict.OUT_OF_ORDER)
        track = later[0].before.copy()
        track.predict(sighting.captured_at_ns)
        innovation = track.innovation(sighting)
        if not innovation.nis <= self._limit:
            self._counters["fix_outlier"] += 1
            return _attempt(FusionVerdict.OUTLIER, innovation)
        self._counters["fix_used"] += 1
        self._counters["fix_late"] += 1
        kept = [step for step in self._past if step not in later]
        self._past = deque(kept, maxlen=_MOST_REMEMBERED)
        self._past.append(_Step(later[0].before, sighting))
        track.fuse(sighting, innovation)
        track.learn(innovation)
        for step in later:
            self._past.append(_Step(track.copy(), step.sighting))
            track.predict(step.sighting.captured_at_ns)
            again = track.innovation(step.sighting)
            track.fuse(step.sighting, again)
            track.learn(again)
        self._track = track
        return _attempt(FusionVerdict.FUSED, innovation)

    def _remember(self, before: PadTrack, sighting: Sighting) -> None:
        self._past.append(_Step(before, sighting))
        while sighting.captured_at_ns - self._past[0].sighting.captured_at_ns > _REMEMBER_NS:
            self._past.popleft()

    def _keep_near(self) -> None:
        """Anchor the frame anew when the pad has travelled far from its origin."""
        frame, track = self._frame, self._track
        if frame is None or track is None or float(track.place_m @ track.place_m) < _FAR_M**2:
            return
        old = frame.local
        try:
            frame.reanchor(old.point_at(*_vector(track.place_m)))
            for one in (track, self._challenger):
                if one is not None:
                    one.rename(frame.local.ned_of(old.point_at(*_vector(one.place_m))))
        except ValueError:
            self._forget()
        self._past.clear()

    def _forget(self) -> None:
        self._frame = self._track = self._challenger = None
        self._past.clear()

    def _is_confirmed(self, track: PadTrack) -> bool:
        return track.fixes >= self._kalman.confirm_fixes

    def _is_worth_keeping(self, track: PadTrack) -> bool:
        return track.horizontal_sigma_m <= self._kalman.give_up_sigma_m

    def _left_out(self, why: str, verdict: FusionVerdict) -> Attempt:
        self._counters[why] += 1
        return Attempt(verdict)


def _attempt(verdict: FusionVerdict, innovation: Innovation, estimate: Filtered | None = None) -> Attempt:
    nis = innovation.nis if innovation.nis <= sys.float_info.max else None
    return Attempt(verdict, innovation.away_m, innovation.variances_m2, nis, estimate)


def _vector(values: Array) -> Vector3:
    north, east, down = values.tolist()
    return (north, east, down)
