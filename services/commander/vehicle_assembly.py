"""One vehicle state from a position and the attitudes around it."""

import math
from collections import deque
from dataclasses import dataclass
from typing import Any

from alight.geometry.rotation import quaternion_normalised, slerp
from alight.runtime.clock import nanoseconds
from schemas.message import GlobalPosition, Quaternion, Vector3
from schemas.vehicle import VehicleState
from services.commander.autopilot_clock import AutopilotClock

NS_PER_MS = 1_000_000
ATTITUDES_KEPT = 64
MAX_GAP_MS = 100
"""Attitudes farther apart than this are not interpolated between."""
MAX_SEPARATION_M = 120.0
"""The geoid is nowhere farther from the ellipsoid."""
FIX_3D = 3
MAX_AHEAD_NS = nanoseconds(0.1)
"""A state that comes out later than now by more than this is not believed: every later one would be older than it, and left out."""
SEPARATION_WAIT_MS = 1500
"""How long the first states wait for GPS_RAW_INT, lest the ellipsoidal height jump when it comes."""


@dataclass(frozen=True)
class _Attitude:
    boot_ms: int
    q_ned_body: Quaternion
    rates_body_rps: Vector3


class VehicleAssembly:
    """Waits with each GLOBAL_POSITION_INT until an attitude at or after it has come, and interpolates between both sides."""

    def __init__(self, clock: AutopilotClock) -> None:
        self._clock = clock
        self._newest_ns = 0
        self.dropped = 0
        """Positions that no attitude fitted to, that came out of order or from the future, or that hold no sense."""
        self.reset()

    def reset(self) -> None:
        """Forget the history: the autopilot has booted anew."""
        self._attitudes: deque[_Attitude] = deque(maxlen=ATTITUDES_KEPT)
        self._waiting: Any = None
        self._separation_m: float | None = None
        self._first_boot_ms: int | None = None

    def take_attitude(self, message: Any, now_ns: int) -> VehicleState | None:
        """Take an ATTITUDE_QUATERNION; returns the state that waited for it."""
        q = (message.q1, message.q2, message.q3, message.q4)
        rates = (message.rollspeed, message.pitchspeed, message.yawspeed)
        if not 0.9 < sum(part * part for part in q) < 1.1 or not all(map(math.isfinite, rates)):
            return None
        if self._attitudes and message.time_boot_ms <= self._attitudes[-1].boot_ms:
            return None
        self._attitudes.append(_Attitude(message.time_boot_ms, quaternion_normalised(q), rates))
        return self._complete(now_ns)

    def take_position(self, message: Any, now_ns: int) -> VehicleState | None:
        """Take a GLOBAL_POSITION_INT; returns its state if the attitudes around it are known already."""
        if self._first_boot_ms is None:
            self._first_boot_ms = message.time_boot_ms
        if self._separation_m is None and message.time_boot_ms - self._first_boot_ms < SEPARATION_WAIT_MS:
            return None
        if self._waiting is not None:
            self.dropped += 1
        self._waiting = message
        return self._complete(now_ns)

    def take_gps(self, message: Any, armed: bool) -> None:
        """Take the geoid separation of a GPS_RAW_INT. It is frozen in flight, where a jump of it would be a jump of the height."""
        separation_m = (message.alt_ellipsoid - message.alt) / 1000.0
        known = message.fix_type >= FIX_3D and message.alt_ellipsoid != 0 and abs(separation_m) <= MAX_SEPARATION_M
        if known and (self._separation_m is None or not armed):
            self._separation_m = separation_m

    @property
    def newest_attitude_ms(self) -> int | None:
        """Boot time of the newest attitude, ms; None before the first."""
        return self._attitudes[-1].boot_ms if self._attitudes else None

    def attitude_at(self, boot_ms: int) -> tuple[Quaternion, Vector3] | None:
        """Attitude (NED from body) and body rates at a boot time, interpolated; None if there is nothing around it."""
        after = next((item for item in self._attitudes if item.boot_ms >= boot_ms), None)
        before = next((item for item in reversed(self._attitudes) if item.boot_ms <= boot_ms), None)
        if after is None or before is None or after.boot_ms - before.boot_ms > MAX_GAP_MS:
            return None
        if after is before:
            return after.q_ned_body, after.rates_body_rps
        part = (boot_ms - before.boot_ms) / (after.boot_ms - before.boot_ms)
        r0, r1 = before.rates_body_rps, after.rates_body_rps
        rates = (
            r0[0] + part * (r1[0] - r0[0]),
            r0[1] + part * (r1[1] - r0[1]),
            r0[2] + part * (r1[2] - r0[2]),
        )
        return slerp(before.q_ned_body, after.q_ned_body, part), rates

    def global_position(self, latitude_e7: int, longitude_e7: int, altitude_mm: int) -> GlobalPosition:
        """A position as MAVLink gives it (AMSL), with the ellipsoidal height by the known geoid separation.

        Raises:
            ValueError: If the numbers are no place on earth.
        """
        altitude_amsl_m = altitude_mm / 1000.0
        return GlobalPosition(
            latitude_deg=latitude_e7 / 1e7,
            longitude_deg=longitude_e7 / 1e7,
            altitude_amsl_m=altitude_amsl_m,
            ellipsoidal_height_m=altitude_amsl_m + (self._separation_m or 0.0),
        )

    def _complete(self, now_ns: int) -> VehicleState | None:
        message = self._waiting
        if message is None or not self._attitudes or self._attitudes[-1].boot_ms < message.time_boot_ms:
            return None
        self._waiting = None
        attitude = self.attitude_at(message.time_boot_ms)
        at_ns = self._clock.utc_ns(message.time_boot_ms * NS_PER_MS)
        if attitude is None or at_ns is None or not self._newest_ns < at_ns <= now_ns + MAX_AHEAD_NS:
            self.dropped += 1
            return None
        try:
            position = self.global_position(message.lat, message.lon, message.alt)
        except ValueError:
            self.dropped += 1
            return None
        self._newest_ns = at_ns
        return VehicleState(
            at_ns=at_ns,
            position=position,
            velocity_ned_mps=(message.vx / 100.0, message.vy / 100.0, message.vz / 100.0),
            q_ned_body=attitude[0],
            angular_velocity_body_rps=attitude[1],
            clock_uncertainty_s=self._clock.uncertainty_s,
        )
