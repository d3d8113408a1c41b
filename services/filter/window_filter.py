"""The paper's filter: windows of fixes, with an outlier gate before them."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from alight.geometry.local import ned_between
from alight.runtime.clock import nanoseconds
from schemas.fix import FixVerdict, PadFix
from schemas.fusion import FusionVerdict
from schemas.settings.filter import FilterMethod
from schemas.vehicle import VehicleState
from services.filter.attempt import Attempt, Filtered
from services.filter.entry import Entry, entry_of
from services.filter.memory_window import MemoryWindow
from services.filter.outlier_gate import OutlierGate


class WindowFilter:
    """`none`, `mean` and `median`. Without fixes it says nothing: the estimate's age tells the reader."""

    def __init__(self, settings: FilterMethod) -> None:
        self._settings = settings
        self._window = MemoryWindow(settings)
        self._gate = OutlierGate(settings.gate)
        self._reset_after_ns = nanoseconds(settings.reset_after_s)
        self._newest_fix_ns = -1
        self._newest_entry_ns = -1
        self._counters: Counter[str] = Counter()

    def counters(self) -> dict[str, int]:
        """See `PadFilter.counters`."""
        return dict(self._counters)

    def take_vehicle(self, state: VehicleState) -> None:
        """A window does not look at the vehicle beyond what the fixes say."""

    def coasted(self) -> Filtered | None:
        """A window does not coast."""
        return None

    def take_fix(self, fix: PadFix) -> Attempt:
        """See `PadFilter.take_fix`."""
        if fix.verdict is not FixVerdict.ACCEPTED:
            return self._left_out("fix_not_accepted", FusionVerdict.NOT_ACCEPTED)
        entry = entry_of(fix)
        if entry is None or fix.vehicle_position is None:
            return self._left_out("fix_incomplete", FusionVerdict.INCOMPLETE)
        if fix.captured_at_ns <= self._newest_fix_ns:
            return self._left_out("fix_out_of_order", FusionVerdict.OUT_OF_ORDER)
        self._newest_fix_ns = fix.captured_at_ns
        if self._newest_entry_ns >= 0 and fix.captured_at_ns - self._newest_entry_ns > self._reset_after_ns:
            self._start_anew("reset_after_silence")
        verdict = FusionVerdict.COLLECTED
        if not self._gate.admits(entry):
            self._counters["fix_outlier"] += 1
            if not self._gate.outvoted:
                return Attempt(FusionVerdict.OUTLIER)
            self._start_anew("reset_outvoted")
            verdict = FusionVerdict.REINITIALISED
        self._counters["fix_used"] += 1
        self._newest_entry_ns = fix.captured_at_ns
        self._window.add(entry)
        estimate = self._release(fix)
        return Attempt(verdict if estimate is None else FusionVerdict.FUSED, estimate=estimate)

    def _release(self, fix: PadFix) -> Filtered | None:
        try:
            if self._window.holds_enough and not self._gate.has_reference:
                self._judge_first_window()
            released = self._window.release(fix.captured_at_ns)
        except ValueError:
            self._start_anew("reset_no_average")
            return None
        if released is None:
            return None
        result, count = released
        self._counters["released"] += 1
        return self._estimate(fix, result, count)

    def _judge_first_window(self) -> None:
        """Before there is an estimate, the window's own median tells its outliers."""
        self._gate.refer_to(self._window.centre())
        dropped = self._window.keep(self._gate.admits)
        self._counters["fix_outlier"] += dropped
        self._counters["fix_used"] -= dropped
        if not len(self._window):
            self._gate.clear()

    def _estimate(self, fix: PadFix, result: Entry, count: int) -> Filtered:
        assert fix.vehicle_position is not None
        pad_ned_m = ned_between(fix.vehicle_position, result.position)
        whole = result if self._settings.method == "none" else self._with_systematic_part(result, pad_ned_m)
        self._gate.refer_to(whole)
        north, east, down = pad_ned_m.tolist()
        return Filtered(
            position=result.position,
            pad_ned_m=(north, east, down),
            azimuth_rad=result.azimuth_rad,
            covariance_ned_m2=whole.covariance_ned_m2,
            azimuth_variance_rad2=whole.azimuth_variance_rad2,
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

    def _left_out(self, why: str, verdict: FusionVerdict) -> Attempt:
        self._counters[why] += 1
        return Attempt(verdict)

    def _start_anew(self, why: str) -> None:
        if len(self._window):
            self._counters[why] += 1
        self._window.clear()
        self._gate.clear()
