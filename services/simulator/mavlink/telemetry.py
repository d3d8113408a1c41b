"""What the autopilot says of itself: one method a message."""

import math
from collections.abc import Callable

from services.simulator.autopilot.autopilot import CAN_ARM_S, HOME_VALID_S, POSITION_VALID_S, STANDBY_S, Autopilot
from services.simulator.autopilot.mode import Mode, base_mode, standard_mode
from services.simulator.estimator import Estimate
from services.simulator.mavlink.dialect import Message, dialect
from services.simulator.mavlink.link import DEFAULT_HZ, Link
from services.simulator.world import World

LOCAL_VALID_S = 1.0
ORIGIN_SET_S = 0.76
SENSORS = (
    (0.0, (0, 0, 52545599)),
    (HOME_VALID_S, (50380815, 52545551, 50364479)),
    (CAN_ARM_S, (50380847, 50446383, 52463679)),
)
"""SYS_STATUS while PX4 starts: from this many seconds after boot, what is present, enabled and healthy."""
PREARM_CHECK = 0x10000000
CAPABILITIES = 0xE4EF
"""As PX4 reports it; the bit of SET_POSITION_TARGET_GLOBAL_INT is not in it although the message works."""
BATTERY_MV = (14400, 16200)
UNKNOWN_16 = 65535
TEMPERATURE_UNKNOWN = 32767
IGNORE_ALL = 63


class Telemetry:
    """Builds messages from the state of this moment; None where there is nothing to say yet."""

    def __init__(self, autopilot: Autopilot, estimate: Estimate, world: World) -> None:
        self._autopilot = autopilot
        self._estimate = estimate
        self._world = world
        self.utc_ns = 0
        """UTC of the autopilot's `now_s`; kept by who drives the clock."""
        self.skipped_s = 0.0
        """Time that passed without being computed: the stamps count it, the autopilot does not."""
        self._ping_sequence = 0
        self._builders: dict[int, Callable[[Link], Message | None]] = {
            message_id: getattr(self, f"_{dialect.mavlink_map[message_id].msgname.lower()}")
            for message_id in (
                *DEFAULT_HZ,
                dialect.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN,
                dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
            )
        }

    def build(self, message_id: int, link: Link) -> Message | None:
        """A message by its number."""
        builder = self._builders.get(message_id)
        return builder(link) if builder else None

    def knows(self, message_id: int) -> bool:
        """Whether there is such a message here."""
        return message_id in self._builders

    @property
    def _ms(self) -> int:
        return round((self._autopilot.now_s + self.skipped_s) * 1e3)

    @property
    def _us(self) -> int:
        return round((self._autopilot.now_s + self.skipped_s) * 1e6)

    def _heartbeat(self, _link: Link) -> Message:
        autopilot = self._autopilot
        if autopilot.failsafe:
            status = dialect.MAV_STATE_CRITICAL
        elif autopilot.armed:
            status = dialect.MAV_STATE_ACTIVE
        elif autopilot.now_s >= STANDBY_S and autopilot.can_arm:
            status = dialect.MAV_STATE_STANDBY
        else:
            status = dialect.MAV_STATE_UNINIT
        return dialect.MAVLink_heartbeat_message(
            dialect.MAV_TYPE_QUADROTOR,
            dialect.MAV_AUTOPILOT_PX4,
            base_mode(autopilot.mode, autopilot.armed),
            int(autopilot.mode),
            status,
            3,
        )

    def _sys_status(self, _link: Link) -> Message:
        autopilot = self._autopilot
        ready = autopilot.now_s >= STANDBY_S and (autopilot.armed or autopilot.can_arm)
        present, enabled, health = next(bits for from_s, bits in reversed(SENSORS) if autopilot.now_s >= from_s)
        health |= PREARM_CHECK if ready else 0
        share = autopilot.battery_remaining
        low, full = BATTERY_MV
        return dialect.MAVLink_sys_status_message(
            present,
            enabled,
            health,
            140,
            round(low + share * (full - low)),
            -1,
            round(100 * share),
            0,
            0,
            0,
            0,
            0,
            0,
        )

    def _battery_status(self, _link: Link) -> Message:
        share = self._autopilot.battery_remaining
        low, full = BATTERY_MV
        voltages = [round(low + share * (full - low)), *[UNKNOWN_16] * 9]
        return dialect.MAVLink_battery_status_message(
            0, 1, 1, TEMPERATURE_UNKNOWN, voltages, -1, 0, -1, round(100 * share), 0, 1
        )

    def _system_time(self, _link: Link) -> Message:
        return dialect.MAVLink_system_time_message(self.utc_ns // 1000, self._ms)

    def _ping(self, _link: Link) -> Message:
        self._ping_sequence += 1
        return dialect.MAVLink_ping_message(self._us, self._ping_sequence, 0, 0)

    def _timesync(self, _link: Link) -> Message:
        """The autopilot's own question: tc1 = 0, ts1 its time."""
        return dialect.MAVLink_timesync_message(0, self._us * 1000)

    def _attitude(self, _link: Link) -> Message:
        e = self._estimate
        w, x, y, z = e.qw, e.qx, e.qy, e.qz
        roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
        pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
        return dialect.MAVLink_attitude_message(self._ms, roll, pitch, e.yaw, e.p, e.q, e.r)

    def _attitude_quaternion(self, _link: Link) -> Message:
        e = self._estimate
        return dialect.MAVLink_attitude_quaternion_message(self._ms, e.qw, e.qx, e.qy, e.qz, e.p, e.q, e.r)

    def _attitude_target(self, _link: Link) -> Message:
        autopilot = self._autopilot
        return dialect.MAVLink_attitude_target_message(
            self._ms, 0, list(autopilot.attitude_setpoint), 0.0, 0.0, 0.0, autopilot.thrust
        )

    def _global_position_int(self, _link: Link) -> Message | None:
        if self._autopilot.now_s < POSITION_VALID_S:
            return None
        e = self._estimate
        latitude_deg, longitude_deg = self._world.degrees(e.north, e.east)
        altitude_m = self._autopilot.origin_altitude_amsl_m - e.down
        home = self._autopilot.home
        above_home_m = (home[2] if home else 0.0) - e.down
        return dialect.MAVLink_global_position_int_message(
            self._ms,
            round(latitude_deg * 1e7),
            round(longitude_deg * 1e7),
            round(altitude_m * 1e3),
            round(above_home_m * 1e3),
            bounded_16(e.vn * 100.0),
            bounded_16(e.ve * 100.0),
            bounded_16(e.vd * 100.0),
            round(math.degrees(e.yaw) % 360.0 * 100.0) % 36000,
        )

    def _local_position_ned(self, _link: Link) -> Message | None:
        e = self._estimate
        if self._autopilot.now_s < LOCAL_VALID_S:
            return None
        return dialect.MAVLink_local_position_ned_message(self._ms, e.north, e.east, e.down, e.vn, e.ve, e.vd)

    def _gps_raw_int(self, _link: Link) -> Message:
        e, world = self._estimate, self._world
        north, east, down = e.gnss_error_ned_m
        latitude_deg, longitude_deg = world.degrees(e.north + north, e.east + east)
        altitude_m = self._autopilot.origin_altitude_amsl_m - e.down - down
        speed = math.hypot(e.vn, e.ve)
        course = round(math.degrees(math.atan2(e.ve, e.vn)) % 360.0 * 100.0) % 36000
        return dialect.MAVLink_gps_raw_int_message(
            self._us,
            3,
            round(latitude_deg * 1e7),
            round(longitude_deg * 1e7),
            round(altitude_m * 1e3),
            70,
            110,
            min(round(speed * 100.0), UNKNOWN_16),
            course,
            10,
            round((altitude_m + world.geoid_separation_m) * 1e3),
            900,
            1780,
            400,
        )

    def _gps_global_origin(self, _link: Link) -> Message | None:
        if self._autopilot.now_s < ORIGIN_SET_S:
            return None
        world = self._world
        altitude_m = self._autopilot.origin_altitude_amsl_m
        return dialect.MAVLink_gps_global_origin_message(
            round(world.latitude_deg * 1e7),
            round(world.longitude_deg * 1e7),
            round(altitude_m * 1e3),
            round(ORIGIN_SET_S * 1e6),
        )

    def _home_position(self, link: Link) -> Message | None:
        autopilot = self._autopilot
        if autopilot.home is None:
            return None
        link.sent_home_version = autopilot.home_version
        north, east, down = autopilot.home
        latitude_deg, longitude_deg = self._world.degrees(north, east)
        q = [math.cos(0.5 * autopilot.home_yaw_rad), 0.0, 0.0, math.sin(0.5 * autopilot.home_yaw_rad)]
        return dialect.MAVLink_home_position_message(
            round(latitude_deg * 1e7),
            round(longitude_deg * 1e7),
            round((autopilot.origin_altitude_amsl_m - down) * 1e3),
            north,
            east,
            down,
            q,
            0.0,
            0.0,
            0.0,
            self._us,
        )

    def _altitude(self, _link: Link) -> Message:
        e, autopilot = self._estimate, self._autopilot
        amsl_m = autopilot.origin_altitude_amsl_m - e.down
        relative_m = (autopilot.home[2] if autopilot.home else 0.0) - e.down
        height_m = e.height_above_ground_m
        return dialect.MAVLink_altitude_message(
            self._us, amsl_m, amsl_m, -e.down, relative_m, amsl_m - height_m, height_m
        )

    def _distance_sensor(self, _link: Link) -> Message:
        centimetres = max(0, min(10000, round(self._estimate.height_above_ground_m * 100.0)))
        return dialect.MAVLink_distance_sensor_message(self._ms, 0, 10000, centimetres, 0, 0, 25, 0)

    def _vfr_hud(self, _link: Link) -> Message:
        e, autopilot = self._estimate, self._autopilot
        heading = round(math.degrees(e.yaw)) % 360
        altitude_m = autopilot.origin_altitude_amsl_m - e.down
        return dialect.MAVLink_vfr_hud_message(
            math.nan, math.hypot(e.vn, e.ve), heading, round(100 * autopilot.thrust), altitude_m, -e.vd
        )

    def _estimator_status(self, _link: Link) -> Message:
        return dialect.MAVLink_estimator_status_message(
            self._us, 1023, 0.02, 0.02, 0.02, 0.05, 0.02, math.nan, 0.3, 0.15
        )

    def _position_target_local_ned(self, _link: Link) -> Message:
        autopilot = self._autopilot
        if not autopilot.armed or autopilot.thrust <= 0.0:
            nan = math.nan
            return dialect.MAVLink_position_target_local_ned_message(
                self._ms, 1, IGNORE_ALL, nan, nan, nan, nan, nan, nan, 0.0, 0.0, 100.0, self._estimate.yaw, 0.0
            )
        s = autopilot.position_control.setpoint
        yaw = self._estimate.yaw if math.isnan(s.yaw) else s.yaw
        return dialect.MAVLink_position_target_local_ned_message(
            self._ms, 1, 0, s.north, s.east, s.down, s.vn, s.ve, s.vd, s.an, s.ae, s.ad, yaw, s.yaw_rate
        )

    def _extended_sys_state(self, _link: Link) -> Message:
        autopilot = self._autopilot
        if autopilot.landed:
            state = dialect.MAV_LANDED_STATE_ON_GROUND
        elif autopilot.mode is Mode.TAKEOFF:
            state = dialect.MAV_LANDED_STATE_TAKEOFF
        elif autopilot.landing:
            state = dialect.MAV_LANDED_STATE_LANDING
        else:
            state = dialect.MAV_LANDED_STATE_IN_AIR
        return dialect.MAVLink_extended_sys_state_message(0, state)

    def _current_mode(self, _link: Link) -> Message:
        autopilot = self._autopilot
        return dialect.MAVLink_current_mode_message(
            standard_mode(autopilot.mode), int(autopilot.mode), int(autopilot.intended)
        )

    def _autopilot_version(self, _link: Link) -> Message:
        version = 0x011100FF
        return dialect.MAVLink_autopilot_version_message(
            CAPABILITIES, version, 0, version, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0x414C49474854
        )


def bounded_16(value: float) -> int:
    """Rounded, within a signed 16-bit integer."""
    return max(-32768, min(32767, round(value)))
