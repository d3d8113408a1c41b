"""SET_POSITION_TARGET_GLOBAL_INT and SET_POSITION_TARGET_LOCAL_NED: frames and masks as PX4 takes them."""

import math

from services.simulator.autopilot.autopilot import Autopilot
from services.simulator.autopilot.setpoint import OffboardSetpoint
from services.simulator.estimator import Estimate
from services.simulator.mavlink.dialect import Message, dialect
from services.simulator.world import World

IGNORE_POSITION = 0x007
IGNORE_VELOCITY = (0x008, 0x010, 0x020)
FORCE = 0x200
IGNORE_YAW = 0x400
IGNORE_YAW_RATE = 0x800
FARTHEST_M = 1e6
FASTEST = 1e3
"""Larger numbers, infinity and NaN are no setpoint: m/s, rad and rad/s alike."""


def from_global(message: Message, autopilot: Autopilot, estimate: Estimate, world: World) -> OffboardSetpoint | None:
    """A global setpoint in the local frame; None if PX4 would drop it.

    Frames 5 (AMSL), 6 (above home) and 11 (above the ground) are taken. Frame 6 carries PX4's sign fault: the difference between home and
    the local origin enters the wrong way round.
    """
    position = None
    if not message.type_mask & IGNORE_POSITION:
        on_earth = abs(message.lat_int) <= 900_000_000 and abs(message.lon_int) <= 1_800_000_000
        if not on_earth or not abs(message.alt) <= FARTHEST_M:
            return None
        north, east = world.metres(message.lat_int * 1e-7, message.lon_int * 1e-7)
        frame, home = message.coordinate_frame, autopilot.home
        if frame == dialect.MAV_FRAME_GLOBAL_INT:
            down = autopilot.origin_altitude_amsl_m - message.alt
        elif frame == dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT and home is not None:
            down = -message.alt - home[2]
        elif frame == dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT:
            down = estimate.down + estimate.height_above_ground_m - message.alt
        else:
            return None
        position = (north, east, down)
    elif message.coordinate_frame not in (5, 6, 11):
        return None
    return complete(message, position, 0.0)


def from_local(message: Message, estimate: Estimate) -> OffboardSetpoint | None:
    """A local setpoint; None if PX4 would drop it. Frame 1 is north, east, down; 8 and 12 turn velocities with the nose."""
    if message.coordinate_frame == dialect.MAV_FRAME_LOCAL_NED:
        position = None
        if not message.type_mask & IGNORE_POSITION:
            position = (message.x, message.y, message.z)
            if not all(abs(value) <= FARTHEST_M for value in position):
                return None
        return complete(message, position, 0.0)
    if message.coordinate_frame in (dialect.MAV_FRAME_BODY_NED, dialect.MAV_FRAME_BODY_FRD):
        return complete(message, None, estimate.yaw)
    return None


def complete(
    message: Message, position: tuple[float, float, float] | None, turned_rad: float
) -> OffboardSetpoint | None:
    """The velocity and yaw of either message beside its position; None if nothing is left to fly."""
    mask = message.type_mask
    if mask & FORCE:
        return None
    asked = (message.vx, message.vy, message.vz)
    vn, ve, vd = (
        math.nan if mask & bit or not abs(value) <= FASTEST else value
        for bit, value in zip(IGNORE_VELOCITY, asked, strict=True)
    )
    if math.isnan(vn) or math.isnan(ve):
        vn = ve = math.nan
    if turned_rad and not math.isnan(vn):
        cos_yaw, sin_yaw = math.cos(turned_rad), math.sin(turned_rad)
        vn, ve = vn * cos_yaw - ve * sin_yaw, vn * sin_yaw + ve * cos_yaw
    velocity = None if math.isnan(vn) and math.isnan(vd) else (vn, ve, vd)
    if position is None and (velocity is None or math.isnan(vn) or math.isnan(vd)):
        return None
    yaw = None if mask & IGNORE_YAW or not abs(message.yaw) <= FASTEST else message.yaw
    rate = None if mask & IGNORE_YAW_RATE or not abs(message.yaw_rate) <= FASTEST else message.yaw_rate
    return OffboardSetpoint(position, velocity, yaw, rate)
