"""The filter: where the pad is, from many fixes."""

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from alight.geometry.local import ned_between
from alight.runtime.clock import nanoseconds
from alight.runtime.node import Arrival, Node, Outputs, Publication
from schemas import topics
from schemas.estimate import PadEstimate
from schemas.fix import FixVerdict, PadFix
from schemas.settings import Settings
from services.filter.entry import Entry, entry_of
from services.filter.memory_window import MemoryWindow
from services.filter.outlier_gate import OutlierGate


class Filter(Node):
    """Turns accepted fixes into estimates. Without fixes it says nothing: the estimate's age tells the reader."""

    service: ClassVar[str] = "filter"

    def __init__(self, settings: Settings) -> None:
        super().__init__()
        self._settings = settings.filter
        self._window = MemoryWindow(self._settings)
        self._gate = OutlierGate(self._settings.gate)
        self._reset_after_ns = nanoseconds(self._settings.reset_after_s)
        self._newest_fix_ns = -1
        self._newest_entry_ns = -1
        self._counters: Counter[str] = Counter()
        self.subscribe(topics.PAD_FIX, self._on_fix)

    def counters(self) -> Mapping[str, int]:
        """What became of the fixes, and how often the window was thrown away and why."""
        return dict(self._counters)

    def _on_fix(self, arrival: Arrival[PadFix]) -> Outputs:
        fix = arrival.message
        if fix.verdict is not FixVerdict.ACCEPTED:
            return self._left_out("fix_not_accepted")
        entry = entry_of(fix)
        if entry is None or fix.vehicle_position is None:
            return self._left_out("fix_incomplete")
        if fix.captured_at_ns <= self._newest_fix_ns:
            return self._left_out("fix_out_of_order")
        self._newest_fix_ns = fix.captured_at_ns
        if self._newest_entry_ns >= 0 and fix.captured_at_ns - self._newest_entry_ns > self._reset_after_ns:
            self._start_anew("reset_after_silence")
        if not self._gate.admits(entry):
            self._counters["fix_outlier"] += 1
            if not self._gate.outvoted:
                return ()
            self._start_anew("reset_outvoted")
        self._counters["fix_used"] += 1
        self._newest_entry_ns = fix.captured_at_ns
        self._window.add(entry)
        return self._release(fix)

    def _release(self, fix: PadFix) -> Outputs:
        try:
            if self._window.holds_enough and not self._gate.has_reference:
                self._judge_first_window()
            released = self._window.release(fix.captured_at_ns)
        except ValueError:
            self._start_anew("reset_no_average")
            return ()
        if released is None:
            return ()
        result, count = released
        estimate = self._estimate(fix, result, count)
        self._counters["released"] += 1
        return (Publication(topics.PAD_ESTIMATE, estimate),)

    def _judge_first_window(self) -> None:
        """Before there is an estimate, the window's own median tells its outliers."""
        self._gate.refer_to(self._window.centre())
        dropped = self._window.keep(self._gate.admits)
        self._counters["fix_outlier"] += dropped
        self._counters["fix_used"] -= dropped
        if not len(self._window):
            self._gate.clear()

    def _estimate(self, fix: PadFix, result: Entry, count: int) -> PadEstimate:
        assert fix.vehicle_position is not None
        pad_ned_m = ned_between(fix.vehicle_position, result.position)
        whole = result if self._settings.method == "none" else self._with_systematic_part(result, pad_ned_m)
        self._gate.refer_to(whole)
        north, east, down = pad_ned_m.tolist()
        return PadEstimate(
            captured_at_ns=fix.captured_at_ns,
            hops=fix.hops,
            position=result.position,
            pad_ned_m=(north, east, down),
            azimuth_rad=result.azimuth_rad,
            covariance_ned_m2=tuple(whole.covariance_ned_m2.ravel().tolist()),
            azimuth_variance_rad2=whole.azimuth_variance_rad2,
            method=self._settings.method,
            fixes_used=count,
        )

    def _with_systematic_part(self, result: Entry, pad_ned_m: NDArray[np.float64]) -> Entry:
        """Adds what all fixes of a window have in common: a turn s of the line of sight p costs s^2 (|p|^2 I - p p^T)."""
        s2 = math.radians(self._settings.systematic_angle_deg) ** 2
        common = s2 * (pad_ned_m @ pad_ned_m * np.eye(3) - np.outer(pad_ned_m, pad_ned_m))
        common += self._settings.systematic_position_m**2 * np.eye(3)
        return replace(
            result,
            covariance_ned_m2=result.covariance_ned_m2 + common,
            azimuth_variance_rad2=result.azimuth_variance_rad2
            + math.radians(self._settings.systematic_azimuth_deg) ** 2,
        )

    def _left_out(self, why: str) -> Outputs:
        self._counters[why] += 1
        return ()

    def _start_anew(self, why: str) -> None:
        if len(self._window):
            self._counters[why] += 1
        self._window.clear()
        self._gate.clear()
