"""What the commander would have said of the vehicle during a flight that only PX4 logged."""

import heapq
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from alight.runtime.clock import nanoseconds
from schemas import topics
from schemas.message import GlobalPosition
from schemas.settings import Settings
from schemas.vehicle import FlightMode, LandedState, VehicleStatus
from services.commander.gimbal import Gimbal
from station.recording_import.heard import Heard
from station.recording_import.ulog import Table, read_ulog
from station.recording_import.ulog_clock import utc_minus_boot_ns
from station.recording_import.ulog_pose import attitude_at, geoid_separation_m, pose_tables, states

LINK_NS = nanoseconds(0.01)
"""From the autopilot's sample until the recorder would have heard of it: a serial link and two hops on the bus."""
STATUS_PERIOD_NS = nanoseconds(0.2)
GIMBAL_PERIOD_NS = nanoseconds(0.1)
ARMED = 2
"""`arming_state` of an armed vehicle, in every version of PX4."""

MODES: Mapping[int, FlightMode] = {
    0: FlightMode.MANUAL,
    1: FlightMode.ALTITUDE,
    2: FlightMode.POSITION,
    3: FlightMode.MISSION,
    4: FlightMode.HOLD,
    5: FlightMode.RETURN,
    14: FlightMode.OFFBOARD,
    17: FlightMode.TAKEOFF,
    18: FlightMode.LAND,
    20: FlightMode.PRECISION_LAND,
}
"""By PX4's `nav_state`."""


@dataclass(frozen=True)
class UlogVehicle:
    """The vehicle of a log."""

    heard: Iterator[Heard]
    """States, status and gimbal, in order of arrival."""
    dated: bool
    """Whether the log knows UTC; otherwise its times count from the autopilot's boot."""


def ulog_vehicle(path: Path, settings: Settings) -> UlogVehicle:
    """Read a log.

    Raises:
        SourceError: If it is no log, or says nothing of where the vehicle was.
    """
    tables = read_ulog(path)
    poses = pose_tables(tables, path)
    offset_ns = utc_minus_boot_ns(tables)
    shift_ns = offset_ns or 0
    moving = (Heard(state.at_ns + LINK_NS, topics.VEHICLE_STATE, state) for state in states(poses, shift_ns))
    streams = (moving, _status(tables, shift_ns), _gimbal(tables, shift_ns, settings))
    return UlogVehicle(heapq.merge(*streams, key=lambda heard: heard.at_ns), offset_ns is not None)


def _times_ns(tables: Mapping[str, Table], period_ns: int) -> range:
    boot_ns = tables["vehicle_attitude"].boot_ns
    return range(int(boot_ns[0]), int(boot_ns[-1]), period_ns)


def _status(tables: Mapping[str, Table], shift_ns: int) -> Iterator[Heard]:
    for boot_ns in _times_ns(tables, STATUS_PERIOD_NS):
        landed = _newest(tables, boot_ns, "vehicle_land_detected", "landed")
        battery = _newest(tables, boot_ns, "battery_status", "remaining")
        ground = LandedState.ON_GROUND if landed else LandedState.IN_AIR
        status = VehicleStatus(
            at_ns=boot_ns + shift_ns,
            connected=True,
            armed=_newest(tables, boot_ns, "vehicle_status", "arming_state") == ARMED,
            mode=_mode(_newest(tables, boot_ns, "vehicle_status", "nav_state")),
            intended_mode=_mode(_newest(tables, boot_ns, "vehicle_status", "nav_state_user_intention")),
            landed_state=LandedState.UNDEFINED if landed is None else ground,
            failsafe=bool(_newest(tables, boot_ns, "vehicle_status", "failsafe")),
            home=_home(tables, boot_ns),
            battery_remaining=battery if battery is not None and 0.0 <= battery <= 1.0 else None,
        )
        yield Heard(status.at_ns + LINK_NS, topics.VEHICLE_STATUS, status)


def _gimbal(tables: Mapping[str, Table], shift_ns: int, settings: Settings) -> Iterator[Heard]:
    """What a gimbal reported, or the fixed mount of the settings."""
    gimbal = Gimbal(settings.commander.fixed_gimbal_rpy_deg)
    reports = tables.get("gimbal_device_attitude_status")
    times_ns = _times_ns(tables, GIMBAL_PERIOD_NS) if reports is None else reports.boot_ns.tolist()
    for row, boot_ns in enumerate(times_ns):
        if reports is not None:
            q = tuple(float(reports.columns[f"q[{i}]"][row]) for i in range(4))
            flags = reports.column("device_flags")
            said = SimpleNamespace(q=q, flags=0 if flags is None else int(flags[row]))
            gimbal.hear(boot_ns + shift_ns)
            gimbal.take(said, attitude_at(tables["vehicle_attitude"], boot_ns), boot_ns + shift_ns)
        state = gimbal.state(boot_ns + shift_ns)
        yield Heard(boot_ns + shift_ns + LINK_NS, topics.GIMBAL_STATE, state)


def _newest(tables: Mapping[str, Table], boot_ns: int, name: str, column: str) -> float | None:
    """The newest value of a column; None if there is none yet, or it is not finite."""
    table = tables.get(name)
    values = None if table is None else table.column(column)
    if table is None or values is None:
        return None
    row = int(np.searchsorted(table.boot_ns, boot_ns, side="right")) - 1
    return float(values[row]) if row >= 0 and np.isfinite(values[row]) else None


def _mode(nav_state: float | None) -> FlightMode:
    return FlightMode.UNKNOWN if nav_state is None else MODES.get(int(nav_state), FlightMode.OTHER)


def _home(tables: Mapping[str, Table], boot_ns: int) -> GlobalPosition | None:
    latitude_deg, longitude_deg, altitude_m = (
        _newest(tables, boot_ns, "home_position", name) for name in ("lat", "lon", "alt")
    )
    if latitude_deg is None or longitude_deg is None or altitude_m is None:
        return None
    return GlobalPosition(
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        altitude_amsl_m=altitude_m,
        ellipsoidal_height_m=altitude_m + geoid_separation_m(tables),
    )
