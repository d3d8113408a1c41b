"""What the recorder knows of the machine that it runs on; only live, never in lockstep."""

import ctypes
import os
import platform
import socket
import time
from contextlib import suppress


class Host:
    """Name and clocks of this machine."""

    def now_ns(self) -> int:
        """The time, UTC ns."""
        return time.time_ns()

    def description(self) -> dict[str, str]:
        """Name, system and clocks: how UTC, as this machine has it, lies against its clock that nobody sets."""
        before_ns = time.monotonic_ns()
        wall_ns = time.time_ns()
        monotonic_ns = (before_ns + time.monotonic_ns()) // 2
        values = {
            "hostname": socket.gethostname(),
            "system": platform.platform(),
            "processors": str(os.cpu_count()),
            "wall_ns": str(wall_ns),
            "monotonic_ns": str(monotonic_ns),
            "wall_minus_monotonic_ns": str(wall_ns - monotonic_ns),
        }
        return values | _discipline()


class _Timex(ctypes.Structure):
    """The beginning of the kernel's `struct timex` (adjtimex(2)), with room for the rest."""

    _fields_ = (
        ("modes", ctypes.c_uint),
        ("offset", ctypes.c_long),
        ("freq", ctypes.c_long),
        ("maxerror", ctypes.c_long),
        ("esterror", ctypes.c_long),
        ("status", ctypes.c_int),
        ("rest", ctypes.c_byte * 256),
    )


_STA_UNSYNC = 0x0040


def _discipline() -> dict[str, str]:
    """Whether NTP or PTP keeps the clock, and how far off the kernel holds it to be at most; nothing where it cannot be asked."""
    with suppress(OSError, AttributeError):
        state = _Timex()
        if ctypes.CDLL(None, use_errno=True).adjtimex(ctypes.byref(state)) >= 0:
            synchronised = not state.status & _STA_UNSYNC
            return {"clock_synchronised": str(synchronised).lower(), "clock_error_max_us": str(state.maxerror)}
    return {}
