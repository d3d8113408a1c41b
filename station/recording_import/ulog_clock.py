"""The autopilot's time since boot, brought to UTC by the GPS time in its log."""

from collections.abc import Mapping

import numpy as np

from station.recording_import.ulog import NS_PER_US, Table

FIX_3D = 3
PLAUSIBLE_UTC_US = 1_000_000_000 * 1_000_000
"""Receivers without time say the epoch, or their own first day; no ULog is older than 2001."""
LEAST_DELAYED_PERCENT = 90


def utc_minus_boot_ns(tables: Mapping[str, Table]) -> int | None:
    """UTC minus boot time, ns; None if the log has no GPS time.

    A receiver's word reaches the autopilot late, never early: so of all differences those with the least delay count, but not the
    very least, which may be one wrong word. What remains, usually about 0.1 s, no log tells; see `--offset`.
    """
    for name in ("sensor_gps", "vehicle_gps_position"):
        table = tables.get(name)
        utc_us = None if table is None else table.column("time_utc_usec")
        if table is None or utc_us is None:
            continue
        known = utc_us > PLAUSIBLE_UTC_US
        fix = table.column("fix_type")
        if fix is not None:
            known &= fix >= FIX_3D
        if known.any():
            # A double holds microseconds since 1970 without loss, nanoseconds not.
            difference_us = utc_us[known] - table.boot_ns[known] / NS_PER_US
            return int(np.percentile(difference_us, LEAST_DELAYED_PERCENT)) * NS_PER_US
    return None
