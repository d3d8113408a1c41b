"""Where a vehicle was and how it was turned, from a PX4 log, at any time between its samples."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from alight.geometry.local import moved_by_ned, ned_between
from alight.geometry.rotation import quaternion_normalised, slerp
from alight.runtime.clock import NS_PER_S
from schemas.message import GlobalPosition, Quaternion, Vector3
from schemas.vehicle import VehicleState
from station.recording_import.source_error import SourceError
from station.recording_import.ulog import Table

LONGEST_GAP_NS = 1_000_000_000
"""Positions farther apart than this are not interpolated between."""
SHORTEST_STEP_NS = 9_000_000
"""Attitudes closer than this are left out: 100 poses a second are enough."""
CLOCK_UNCERTAINTY_S = 0.02
"""How well a video is aligned with a log at best, where no clock was common to both."""
MAX_SEPARATION_M = 120.0
"""The geoid is nowhere farther from the ellipsoid."""


@dataclass(frozen=True)
class PoseTables:
    """The tables that a pose needs."""

    position: Table
    attitude: Table
    velocity: Table | None
    rates: Table | None
    separation_m: float
    """Ellipsoidal height minus altitude above mean sea level."""


def pose_tables(tables: Mapping[str, Table], path: Path) -> PoseTables:
    """Pick them out of a log.

    Raises:
        SourceError: If the log never knew where the vehicle was.
    """
    position, attitude = tables.get("vehicle_global_position"), tables.get("vehicle_attitude")
    known = None if position is None else position.where_finite("lat", "lon", "alt")
    if known is None:
        raise SourceError(
            f"{path}: has no vehicle_global_position: the autopilot had no position on the earth (no GPS fix), or did not log it"
        )
    if attitude is None:
        raise SourceError(f"{path}: has no vehicle_attitude: the autopilot did not log it")
    velocity, rates = tables.get("vehicle_local_position"), tables.get("vehicle_angular_velocity")
    return PoseTables(
        known,
        attitude,
        None if velocity is None else velocity.where_finite("vx", "vy", "vz"),
        None if rates is None else rates.where_finite("xyz[0]", "xyz[1]", "xyz[2]"),
        geoid_separation_m(tables),
    )


def geoid_separation_m(tables: Mapping[str, Table]) -> float:
    """Ellipsoidal height minus altitude above mean sea level, median over the log, metres; 0 where the log does not know."""
    candidates = (
        ("vehicle_global_position", "alt_ellipsoid", "alt", 1.0),
        ("sensor_gps", "altitude_ellipsoid_m", "altitude_msl_m", 1.0),
        ("sensor_gps", "alt_ellipsoid", "alt", 1e-3),
        ("vehicle_gps_position", "altitude_ellipsoid_m", "altitude_msl_m", 1.0),
        ("vehicle_gps_position", "alt_ellipsoid", "alt", 1e-3),
    )
    for name, ellipsoid, sea_level, unit_m in candidates:
        table = tables[name].where_finite(ellipsoid, sea_level) if name in tables else None
        if table is not None:
            separation_m = float(np.median(table.columns[ellipsoid] - table.columns[sea_level])) * unit_m
            if separation_m != 0.0 and abs(separation_m) <= MAX_SEPARATION_M:
                return separation_m
    return 0.0


@dataclass(frozen=True)
class _Track:
    """Positions with the velocities at them."""

    boot_ns: NDArray[np.int64]
    places: Sequence[GlobalPosition]
    velocities_ned_mps: NDArray[np.float64]

    @classmethod
    def of(cls, poses: PoseTables) -> "_Track":
        table = poses.position
        rows = zip(table.columns["lat"], table.columns["lon"], table.columns["alt"], strict=True)
        places = [_place(float(lat), float(lon), float(alt), poses.separation_m) for lat, lon, alt in rows]
        return cls(table.boot_ns, places, _velocities(table, poses.velocity, places))

    def at(self, boot_ns: int) -> tuple[GlobalPosition, Vector3] | None:
        """Position and velocity (NED, m/s) between two samples; None beyond the ends and in a gap."""
        after = int(np.searchsorted(self.boot_ns, boot_ns))
        if after == len(self.places) or (after == 0 and boot_ns < self.boot_ns[0]):
            return None
        before = max(after - 1, 0)
        span_ns = int(self.boot_ns[after] - self.boot_ns[before])
        if span_ns > LONGEST_GAP_NS:
            return None
        v0, v1 = self.velocities_ned_mps[before], self.velocities_ned_mps[after]
        if span_ns == 0:
            return self.places[after], _vector(v1)
        part, span_s = (boot_ns - int(self.boot_ns[before])) / span_ns, span_ns / NS_PER_S
        step_m = ned_between(self.places[before], self.places[after])
        moved_m = (
            step_m * (3.0 - 2.0 * part) * part**2
            + v0 * span_s * part * (1.0 - part) ** 2
            - v1 * span_s * part**2 * (1.0 - part)
        )
        return moved_by_ned(self.places[before], moved_m), _vector(v0 + part * (v1 - v0))


def _place(latitude_deg: float, longitude_deg: float, altitude_amsl_m: float, separation_m: float) -> GlobalPosition:
    return GlobalPosition(
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        altitude_amsl_m=altitude_amsl_m,
        ellipsoidal_height_m=altitude_amsl_m + separation_m,
    )


def _velocities(position: Table, velocity: Table | None, places: Sequence[GlobalPosition]) -> NDArray[np.float64]:
    """Velocity at each position, (rows, 3), NED, m/s: as the autopilot estimated it, else by differences."""
    for table, names in ((velocity, ("vx", "vy", "vz")), (position, ("vel_n", "vel_e", "vel_d"))):
        if table is not None and all(name in table.columns for name in names):
            return np.stack([np.interp(position.boot_ns, table.boot_ns, table.columns[name]) for name in names], axis=1)
    if len(places) < 2:
        return np.zeros((len(places), 3))
    along_m = np.array([ned_between(places[0], place) for place in places])
    return np.asarray(np.gradient(along_m, position.boot_ns / NS_PER_S, axis=0), np.float64)


def _vector(values: NDArray[np.float64]) -> Vector3:
    north, east, down = (float(value) for value in values)
    return north, east, down


def states(poses: PoseTables, utc_minus_boot_ns: int) -> Iterator[VehicleState]:
    """A state for each attitude between two positions, stamped in UTC.

    Attitudes are logged more often than positions, which follow a cubic between two samples that fits the velocities at both
    (Hermite): at the 5 Hz of PX4's default profile a straight line would be centimetres off in a gust.
    """
    track = _Track.of(poses)
    newest_ns = -SHORTEST_STEP_NS
    for row, boot_ns in enumerate(poses.attitude.boot_ns.tolist()):
        if boot_ns - newest_ns < SHORTEST_STEP_NS:
            continue
        place = track.at(boot_ns)
        attitude = _attitude(poses.attitude, row)
        if place is None or attitude is None:
            continue
        newest_ns = boot_ns
        yield VehicleState(
            at_ns=boot_ns + utc_minus_boot_ns,
            position=place[0],
            velocity_ned_mps=place[1],
            q_ned_body=attitude,
            angular_velocity_body_rps=_rates(poses.rates, boot_ns),
            clock_uncertainty_s=CLOCK_UNCERTAINTY_S,
        )


def attitude_at(attitude: Table, boot_ns: int) -> Quaternion:
    """Attitude (NED from body) at a time, interpolated; beyond the ends the nearest one."""
    after = int(np.searchsorted(attitude.boot_ns, boot_ns))
    last = len(attitude.boot_ns) - 1
    if after == 0 or after > last:
        return _attitude(attitude, min(after, last)) or (1.0, 0.0, 0.0, 0.0)
    before_ns, after_ns = attitude.boot_ns[after - 1], attitude.boot_ns[after]
    q0, q1 = _attitude(attitude, after - 1), _attitude(attitude, after)
    if q0 is None or q1 is None:
        return q0 or q1 or (1.0, 0.0, 0.0, 0.0)
    return slerp(q0, q1, float(boot_ns - before_ns) / float(after_ns - before_ns))


def _attitude(attitude: Table, row: int) -> Quaternion | None:
    q = tuple(float(attitude.columns[f"q[{i}]"][row]) for i in range(4))
    return quaternion_normalised(q) if 0.9 < sum(part * part for part in q) < 1.1 else None


def _rates(rates: Table | None, boot_ns: int) -> Vector3:
    if rates is None:
        return 0.0, 0.0, 0.0
    x, y, z = (float(np.interp(boot_ns, rates.boot_ns, rates.columns[f"xyz[{i}]"])) for i in range(3))
    return x, y, z
