"""The filter: where the pad is, from many fixes."""

from collections import Counter, deque
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from alight.runtime.clock import nanoseconds, seconds
from alight.runtime.node import Arrival, Node, Outputs, Publication
from schemas import topics
from schemas.estimate import PadEstimate
from schemas.fix import PadFix
from schemas.fusion import Fusion, FusionAttempt, FusionVerdict
from schemas.message import Matrix3
from schemas.settings import Settings
from schemas.settings.filter import FilterMethod
from schemas.vehicle import VehicleState
from services.filter.attempt import Attempt, Filtered, PadFilter
from services.filter.kalman_filter import KalmanFilter
from services.filter.window_filter import WindowFilter

_COASTS_AFTER_NS = nanoseconds(0.3)
"""A filter that was given no fix for this long is said to coast."""
_MOST_WAITING = 64


class Filter(Node):
    """Turns accepted fixes into estimates; an estimate leaves as soon as its fix is in.

    What need not be quick waits for the next tick: the shadow filters, which have no authority, and the log of what each
    filter made of each fix. Without fixes no estimate leaves: its age tells the reader. What the active filter coasts to
    meanwhile stands in the log.
    """

    service: ClassVar[str] = "filter"
    answers_at_once = True
    tick_period_ns = nanoseconds(0.05)

    def __init__(self, settings: Settings) -> None:
        super().__init__()
        self._settings = settings.filter
        self._active = pad_filter(settings.filter)
        self._shadows = [(shadow, pad_filter(shadow)) for shadow in settings.filter.shadows]
        self._waiting: deque[tuple[PadFix, Attempt]] = deque(maxlen=_MOST_WAITING)
        self._newest_fused_ns: int | None = None
        self._written_ns = 0
        self._coasted_ns = 0
        self._unwritten: Counter[str] = Counter()
        self.subscribe(topics.PAD_FIX, self._on_fix)
        self.subscribe(topics.VEHICLE_STATE, self._on_vehicle_state)

    def counters(self) -> Mapping[str, int]:
        """What became of the fixes in the active filter, and how often its estimate was thrown away and why."""
        return {**self._active.counters(), **self._unwritten}

    def on_tick(self, now_ns: int) -> Outputs:
        """Give the fixes to the shadows, and write down what became of them."""
        outputs = [self._written(fix, attempt, now_ns) for fix, attempt in self._waiting]
        self._waiting.clear()
        coasting = self._coasting(now_ns)
        return outputs if coasting is None else [*outputs, coasting]

    def _on_fix(self, arrival: Arrival[PadFix]) -> Outputs:
        fix = arrival.message
        attempt = self._active.take_fix(fix)
        if attempt.estimate is not None:
            yield Publication(topics.PAD_ESTIMATE, self._estimate(fix, attempt.estimate))
        if len(self._waiting) == _MOST_WAITING:
            self._unwritten["fixes_unwritten"] += 1
        self._waiting.append((fix, attempt))
        if attempt.verdict is FusionVerdict.FUSED:
            self._newest_fused_ns = fix.captured_at_ns

    def _on_vehicle_state(self, arrival: Arrival[VehicleState]) -> Outputs:
        self._active.take_vehicle(arrival.message)
        for _, shadow in self._shadows:
            shadow.take_vehicle(arrival.message)
        return ()

    def _estimate(self, fix: PadFix, filtered: Filtered) -> PadEstimate:
        return PadEstimate(
            captured_at_ns=fix.captured_at_ns,
            hops=fix.hops,
            position=filtered.position,
            pad_ned_m=filtered.pad_ned_m,
            azimuth_rad=filtered.azimuth_rad,
            covariance_ned_m2=tuple(filtered.covariance_ned_m2.ravel().tolist()),
            azimuth_variance_rad2=filtered.azimuth_variance_rad2,
            method=self._settings.method,
            fixes_used=filtered.fixes_used,
            velocity_ned_mps=filtered.velocity_ned_mps,
            velocity_covariance_ned=_rows(filtered.velocity_covariance_ned),
            position_at_ns=filtered.position_at_ns,
        )

    def _written(self, fix: PadFix, active: Attempt, now_ns: int) -> Publication:
        attempts = [_as_message("active", self._settings, active, with_estimate=False)]
        attempts += [
            _as_message(settings.name, settings, shadow.take_fix(fix), with_estimate=True)
            for settings, shadow in self._shadows
        ]
        at_ns = self._next_stamp_ns(now_ns)
        return Publication(
            topics.FUSION, Fusion(at_ns=at_ns, captured_at_ns=fix.captured_at_ns, attempts=tuple(attempts))
        )

    def _coasting(self, now_ns: int) -> Publication | None:
        newest_ns = self._newest_fused_ns
        if newest_ns is None or now_ns - newest_ns < _COASTS_AFTER_NS or now_ns - self._coasted_ns < _COASTS_AFTER_NS:
            return None
        self._coasted_ns = now_ns
        filtered = self._active.coasted()
        if filtered is None:
            return None
        attempt = Attempt(FusionVerdict.COASTED, estimate=filtered)
        coasting = Fusion(
            at_ns=self._next_stamp_ns(now_ns),
            fix_age_s=seconds(now_ns - newest_ns),
            attempts=(_as_message("active", self._settings, attempt, with_estimate=True),),
        )
        return Publication(topics.FUSION, coasting)

    def _next_stamp_ns(self, now_ns: int) -> int:
        """Now, or just after the last one: readers refuse a stamp that is not newer."""
        self._written_ns = max(now_ns, self._written_ns + 1)
        return self._written_ns


def pad_filter(settings: FilterMethod) -> PadFilter:
    """The filter of a method."""
    return KalmanFilter(settings) if settings.method in ("kalman", "moving") else WindowFilter(settings)


def _rows(matrix: NDArray[np.float64] | None) -> Matrix3 | None:
    return None if matrix is None else tuple(matrix.ravel().tolist())


def _as_message(name: str, settings: FilterMethod, attempt: Attempt, *, with_estimate: bool) -> FusionAttempt:
    return FusionAttempt(
        name=name,
        method=settings.method,
        verdict=attempt.verdict,
        innovation_ned_m=attempt.innovation_ned_m,
        innovation_sigma_m=attempt.innovation_sigma_m,
        nis=attempt.nis,
        estimate=attempt.estimate.as_message() if with_estimate and attempt.estimate is not None else None,
    )
