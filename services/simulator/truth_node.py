"""Ground truth from a PX4 simulation (SIH) that runs elsewhere, heard over MAVLink."""

import math
from collections.abc import Mapping

from alight.runtime.clock import nanoseconds
from alight.runtime.node import Node, Output, Outputs, Publication, Transmission
from schemas.message import GlobalPosition, Quaternion
from schemas.settings import Settings
from schemas.topics import GROUND_TRUTH
from schemas.truth import GroundTruth
from services.simulator.mavlink.dialect import Message, dialect
from services.simulator.world import World

TICK_NS = 50_000_000
HEARTBEAT_NS = 1_000_000_000
TIMESYNC_NS = 200_000_000
SILENT_NS = 1_000_000_000
WANTED_HZ = 100.0
MAX_ROUND_TRIP_NS = 50_000_000
STANDING_MPS = 0.1
FLOOR_PARAMETER = "SIH_LOC_H0"
"""Altitude of the simulation's ground, metres above mean sea level."""
FLOOR_PERIOD_NS = 500_000_000
FLOOR_REQUESTS = 6
"""A simulation that does not know the parameter says nothing: after so many requests the vehicle is taken to stand on the ground."""
FLOOR_NEAR_M = 2.0
"""A vehicle that stands farther away from that altitude stands on something else."""
ON_GROUND = 1
SYSTEM_ID = 254
COMPONENT_ID = 190


class TruthNode(Node):
    """Asks the simulation for HIL_STATE_QUATERNION (its truth) and publishes it as GROUND_TRUTH.

    Home is the first sample on the ground; the pad lies at the configured offset from it. The simulation has no legs: its body stands on
    the ground, so the ground is taken to be `vehicle.gear_height_m` below it, as in the embedded simulator. How high its ground is, the
    simulation is asked: it stops a vehicle that has sunk into it and leaves it there, on a busy host a quarter of a metre deep (measured),
    and whoever took that for the ground would find the next landing hanging in the air. Until home is known, and until TIMESYNC has told
    the autopilot's time, nothing is published.
    """

    service = "simulator"
    tick_period_ns = TICK_NS
    ports = ("vehicle",)

    def __init__(self, settings: Settings) -> None:
        super().__init__()
        self._settings = settings.simulator
        self._target = settings.simulator.system_id
        self._encoder = dialect.MAVLink(None, srcSystem=SYSTEM_ID, srcComponent=COMPONENT_ID)
        self._parser = dialect.MAVLink(None)
        self._parser.robust_parsing = True
        self._world: World | None = None
        self._landed = False
        self._offset_ns: int | None = None
        """UTC minus the autopilot's boot time."""
        self._best_round_trip_ns = MAX_ROUND_TRIP_NS
        self._heartbeat_due_ns = 0
        self._timesync_due_ns = 0
        self._floor_m: float | None = None
        self._floor_due_ns = 0
        self._floor_requests = 0
        self._heard_at_ns = 0
        self._newest_ns = 0
        self._refused = 0

    def on_tick(self, now_ns: int) -> Outputs:
        """Keep the link alive, keep time, and ask for the stream until it comes."""
        out: list[Output] = []
        if now_ns >= self._heartbeat_due_ns:
            self._heartbeat_due_ns = now_ns + HEARTBEAT_NS
            out.append(
                self._send(
                    dialect.MAVLink_heartbeat_message(dialect.MAV_TYPE_GCS, dialect.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3)
                )
            )
            if now_ns - self._heard_at_ns > SILENT_NS:
                out += [
                    self._ask(dialect.MAVLINK_MSG_ID_HIL_STATE_QUATERNION, WANTED_HZ),
                    self._ask(dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 5.0),
                ]
        if now_ns >= self._timesync_due_ns:
            self._timesync_due_ns = now_ns + TIMESYNC_NS
            out.append(self._send(dialect.MAVLink_timesync_message(0, now_ns)))
        if self._asks_floor and now_ns >= self._floor_due_ns:
            self._floor_due_ns = now_ns + FLOOR_PERIOD_NS
            self._floor_requests += self._heard_at_ns > 0
            out.append(
                self._send(
                    dialect.MAVLink_param_request_read_message(self._target, 1, FLOOR_PARAMETER.encode("ascii"), -1)
                )
            )
        return out

    def on_bytes(self, port: str, data: bytes, now_ns: int) -> Outputs:  # noqa: ARG002
        """Take what the simulation says."""
        out: list[Output] = []
        for message in self._parser.parse_buffer(data) or []:
            kind = message.get_type()
            if kind == "BAD_DATA":
                self._refused += 1
            elif message.get_srcSystem() == self._target:
                if kind == "TIMESYNC":
                    self._keep_time(message, now_ns)
                elif kind == "EXTENDED_SYS_STATE":
                    self._landed = message.landed_state == ON_GROUND
                elif kind == "PARAM_VALUE":
                    self._take_parameter(message)
                elif kind == "HIL_STATE_QUATERNION":
                    self._heard_at_ns = now_ns
                    out += self._take(message, now_ns)
        return out

    def counters(self) -> Mapping[str, int]:
        """See `Node.counters`."""
        return {"refused_mavlink": self._refused}

    def complaints(self, now_ns: int) -> tuple[str, ...]:
        """See `Node.complaints`."""
        if now_ns - self._heard_at_ns > SILENT_NS:
            return (f"no ground truth (HIL_STATE_QUATERNION) from system {self._target} on {self._settings.truth_url}",)
        if self._asks_floor:
            return (f"asking the simulation how high its ground is ({FLOOR_PARAMETER})",)
        if self._world is None:
            return ("waiting for the vehicle to stand on the ground: its place there is home",)
        if self._offset_ns is None:
            return (f"no ground truth yet: system {self._target} does not answer TIMESYNC",)
        return ()

    @property
    def _asks_floor(self) -> bool:
        return self._world is None and self._floor_m is None and self._floor_requests < FLOOR_REQUESTS

    def _take_parameter(self, message: Message) -> None:
        if message.param_id == FLOOR_PARAMETER and math.isfinite(message.param_value):
            self._floor_m = message.param_value

    def _keep_time(self, message: Message, now_ns: int) -> None:
        """Take the offset of the quickest round trip; an old one counts less and less, since clocks drift."""
        if message.tc1 == 0:
            return
        round_trip_ns = now_ns - message.ts1
        if 0 <= round_trip_ns <= self._best_round_trip_ns:
            self._best_round_trip_ns = round_trip_ns
            self._offset_ns = message.ts1 + round_trip_ns // 2 - message.tc1
        self._best_round_trip_ns = min(MAX_ROUND_TRIP_NS, self._best_round_trip_ns + 20_000)

    def _take(self, message: Message, now_ns: int) -> list[Output]:
        position = (message.lat * 1e-7, message.lon * 1e-7, message.alt * 1e-3)
        speed = math.sqrt(message.vx**2 + message.vy**2 + message.vz**2) * 1e-2
        standing = self._landed and speed < STANDING_MPS and position[:2] != (0.0, 0.0)
        if self._world is None and standing and not self._asks_floor:
            self._world = self._world_at(*position)
        if self._world is None or self._offset_ns is None:
            return []
        at_ns = message.time_usec * 1000 + self._offset_ns
        quaternion = normalised(message.attitude_quaternion)
        if at_ns <= self._newest_ns or abs(at_ns - now_ns) > nanoseconds(5.0) or quaternion is None:
            self._refused += at_ns > self._newest_ns
            return []
        self._newest_ns = at_ns
        return [Publication(GROUND_TRUTH, self._truth(message, position, quaternion, self._world, at_ns))]

    def _world_at(self, latitude_deg: float, longitude_deg: float, altitude_amsl_m: float) -> World:
        floor_m = altitude_amsl_m
        if self._floor_m is not None and abs(self._floor_m - altitude_amsl_m) <= FLOOR_NEAR_M:
            floor_m = self._floor_m
        ground_m = floor_m - self._settings.vehicle.gear_height_m
        home = self._settings.home.model_copy(
            update={"latitude_deg": latitude_deg, "longitude_deg": longitude_deg, "altitude_amsl_m": ground_m}
        )
        return World.from_settings(self._settings.model_copy(update={"home": home}))

    def _truth(
        self, message: Message, position: tuple[float, float, float], quaternion: Quaternion, world: World, at_ns: int
    ) -> GroundTruth:
        latitude_deg, longitude_deg, altitude_amsl_m = position
        north_m, east_m = world.metres(latitude_deg, longitude_deg)
        down_m = world.altitude_amsl_m - altitude_amsl_m
        pad_n, pad_e, pad_d = world.pad_ned_m
        return GroundTruth(
            at_ns=at_ns,
            vehicle_position=GlobalPosition(
                latitude_deg=latitude_deg,
                longitude_deg=longitude_deg,
                altitude_amsl_m=altitude_amsl_m,
                ellipsoidal_height_m=altitude_amsl_m + world.geoid_separation_m,
            ),
            velocity_ned_mps=(message.vx * 1e-2, message.vy * 1e-2, message.vz * 1e-2),
            q_ned_body=quaternion,
            angular_velocity_body_rps=(message.rollspeed, message.pitchspeed, message.yawspeed),
            pad_position=world.global_position(pad_n, pad_e, pad_d),
            pad_azimuth_rad=world.pad_azimuth_rad,
            vehicle_from_pad_ned_m=(north_m - pad_n, east_m - pad_e, down_m - pad_d),
            touching_ground=down_m
            >= world.ground_down_m(north_m, east_m) - self._settings.vehicle.gear_height_m - 0.02,
        )

    def _ask(self, message_id: int, hz: float) -> Transmission:
        return self._send(
            dialect.MAVLink_command_long_message(
                self._target, 1, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 0, message_id, 1e6 / hz, 0, 0, 0, 0, 0
            )
        )

    def _send(self, message: Message) -> Transmission:
        data = message.pack(self._encoder)
        self._encoder.seq = (self._encoder.seq + 1) % 256
        return Transmission("vehicle", data)


def normalised(quaternion: list[float]) -> Quaternion | None:
    """The unit quaternion with w >= 0 (the simulation flips the sign); None for nonsense."""
    length = math.sqrt(sum(value * value for value in quaternion))
    if not 0.5 < length < 2.0:
        return None
    scale = math.copysign(1.0 / length, quaternion[0])
    w, x, y, z = (scale * value for value in quaternion)
    return w, x, y, z
