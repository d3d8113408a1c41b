"""What gimbals report, joined with the vehicle's attitude at the same time."""

from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from schemas.message import Vector3
from schemas.vehicle import GimbalState
from services.commander.autopilot_clock import AutopilotClock
from services.commander.device_clock import DeviceClock
from services.commander.dialect import mavlink
from services.commander.gimbal import Gimbal
from services.commander.vehicle_assembly import MAX_AHEAD_NS, NS_PER_MS, VehicleAssembly

MOST_WAITING = 64


@dataclass(frozen=True)
class _Report:
    message: Any
    at_ns: int
    boot_ms: int
    """The autopilot's boot time at `at_ns`, by which its attitudes are found."""


class GimbalReports:
    """Waits with each GIMBAL_DEVICE_ATTITUDE_STATUS until an attitude at or after it has come.

    The autopilot's own component speaks by the autopilot's clock. A gimbal device that speaks for itself, whose messages the autopilot
    only forwards, has booted at another time: its stamps say nothing by the autopilot's clock, however plausible they look.
    """

    def __init__(self, fixed_rpy_deg: Vector3, clock: AutopilotClock, assembly: VehicleAssembly) -> None:
        """Take the fixed mount's roll, pitch and yaw, degrees, which rules until a gimbal reports."""
        self._gimbal = Gimbal(fixed_rpy_deg)
        self._clock = clock
        self._assembly = assembly
        self._device_clocks: dict[int, DeviceClock] = {}
        self._counts: Counter[str] = Counter()
        self.reset()

    def reset(self) -> None:
        """Forget what waits: the autopilot has booted anew. That there is a gimbal is not forgotten."""
        self._waiting: deque[_Report] = deque(maxlen=MOST_WAITING)

    def take(self, message: Any, now_ns: int) -> None:
        """Take a GIMBAL_DEVICE_ATTITUDE_STATUS of whichever component."""
        self._counts["gimbal_reports"] += 1
        self._gimbal.hear(now_ns)
        at_ns = self._made_at_ns(message, now_ns)
        boot_ns = None if at_ns is None else self._clock.boot_ns(at_ns)
        if at_ns is None or boot_ns is None or not 0 <= at_ns <= now_ns + MAX_AHEAD_NS:
            self._counts["gimbal_reports_refused"] += 1
            return
        if len(self._waiting) == MOST_WAITING:
            self._counts["gimbal_reports_refused"] += 1
        self._waiting.append(_Report(message, at_ns, boot_ns // NS_PER_MS))
        self.join()

    def join(self) -> None:
        """Use the reports for which an attitude has come since."""
        newest_ms = self._assembly.newest_attitude_ms
        while newest_ms is not None and self._waiting and self._waiting[0].boot_ms <= newest_ms:
            report = self._waiting.popleft()
            attitude = self._assembly.attitude_at(report.boot_ms)
            if attitude is None or not self._gimbal.take(report.message, attitude[0], report.at_ns):
                self._counts["gimbal_reports_refused"] += 1

    def state(self, now_ns: int) -> GimbalState:
        """What to publish now."""
        return self._gimbal.state(now_ns)

    def complaints(self, now_ns: int) -> tuple[str, ...]:
        """What is wrong with it, in words with the consequence."""
        return self._gimbal.complaints(now_ns)

    def counters(self) -> Mapping[str, int]:
        """Reports, and those of them that could not be used; nothing if none ever came."""
        return dict(self._counts)

    def _made_at_ns(self, message: Any, now_ns: int) -> int | None:
        boot_ns = message.time_boot_ms * NS_PER_MS
        component = message.get_srcComponent()
        if component == mavlink.MAV_COMP_ID_AUTOPILOT1:
            return self._clock.utc_ns(boot_ns)
        return self._device_clocks.setdefault(component, DeviceClock()).utc_ns(boot_ns, now_ns)
