"""PX4's own logs (`.ulg`): the tables in them that say where the vehicle was and what it did."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from station.recording_import.source_error import SourceError

TABLES = (
    "vehicle_global_position",
    "vehicle_local_position",
    "vehicle_attitude",
    "vehicle_angular_velocity",
    "vehicle_status",
    "vehicle_land_detected",
    "home_position",
    "battery_status",
    "gimbal_device_attitude_status",
    "sensor_gps",
    "vehicle_gps_position",
)
NS_PER_US = 1000

Column = NDArray[np.float64]


@dataclass(frozen=True)
class Table:
    """One topic of the log."""

    boot_ns: NDArray[np.int64]
    """Time since boot, ns, strictly ascending."""
    columns: Mapping[str, Column]
    """Values by name; elements of arrays as `q[0]`."""

    def column(self, *names: str) -> Column | None:
        """The first of these columns that the table has: PX4 renamed some over the years."""
        return next((self.columns[name] for name in names if name in self.columns), None)

    def where_finite(self, *names: str) -> "Table | None":
        """The rows in which all of these columns hold numbers; None if there are none, or the table lacks a column."""
        if not all(name in self.columns for name in names):
            return None
        rows = np.all([np.isfinite(self.columns[name]) for name in names], axis=0)
        return (
            Table(self.boot_ns[rows], {name: column[rows] for name, column in self.columns.items()})
            if rows.any()
            else None
        )


def read_ulog(path: Path) -> Mapping[str, Table]:
    """The tables of a log that matter here, by topic; of topics with several instances the first.

    Raises:
        SourceError: If the file cannot be read or is no ULog, or the reader is not installed.
    """
    try:
        from pyulog import ULog  # noqa: PLC0415 - an extra
    except ImportError:
        raise SourceError(f"{path}: reading .ulg needs pyulog: pip install 'alight[import]'") from None
    try:
        log = ULog(str(path), list(TABLES))
    except OSError as error:
        raise SourceError(f"{path}: cannot be read ({error.strerror}): check the path") from None
    except Exception as error:  # pyulog raises whatever the damage makes it stumble over
        raise SourceError(f"{path}: no ULog, or a damaged one ({error})") from None
    return {
        found.name: _table(found.data)
        for found in log.data_list
        if found.multi_id == 0 and len(found.data["timestamp"])
    }


def _table(data: Mapping[str, NDArray[np.generic]]) -> Table:
    time_us = np.asarray(data["timestamp"], np.int64)
    newest_before = np.maximum.accumulate(np.concatenate(([-1], time_us[:-1])))
    ascending = time_us > newest_before
    columns = {name: np.asarray(values[ascending], np.float64) for name, values in data.items() if name != "timestamp"}
    return Table(time_us[ascending] * NS_PER_US, columns)
