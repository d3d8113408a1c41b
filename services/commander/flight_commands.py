"""The commands and setpoints that move the vehicle, as MAVLink messages."""

import math
from typing import Any

from schemas.message import GlobalPosition, Vector3
from schemas.vehicle import FlightMode
from services.commander.command_queue import Command
from services.commander.dialect import mavlink
from services.commander.px4_mode import main_and_sub

USE_ALL_BUT_YAW_RATE = mavlink.POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE
"""Position, velocity, acceleration and yaw: 0x800. PX4 adds velocity and acceleration to what its position control asks for, so the
vehicle follows a moving setpoint without lag."""

SET_MODE = mavlink.MAV_CMD_DO_SET_MODE
ARM_DISARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
TAKEOFF = mavlink.MAV_CMD_NAV_TAKEOFF
REPOSITION = mavlink.MAV_CMD_DO_REPOSITION
LAND = mavlink.MAV_CMD_NAV_LAND


def set_mode(mode: FlightMode) -> Command:
    """DO_SET_MODE to HOLD, LAND or OFFBOARD."""
    main, sub = main_and_sub(mode)
    custom_mode_enabled = 1.0
    return Command(f"set mode {mode}", SET_MODE, (custom_mode_enabled, float(main), float(sub)))


def arm() -> Command:
    """Arm, with all of the autopilot's checks."""
    return Command("arm", ARM_DISARM, (1.0,))


def disarm() -> Command:
    """Disarm; the autopilot refuses it in the air."""
    return Command("disarm", ARM_DISARM, (0.0,))


def takeoff(altitude_amsl_m: float) -> Command:
    """NAV_TAKEOFF straight up. The altitude is AMSL: with a relative one PX4 accepts and never lifts."""
    return Command("takeoff", TAKEOFF, (math.nan,) * 6 + (altitude_amsl_m,))


def reposition(target: GlobalPosition, yaw_ned_rad: float | None) -> Command:
    """DO_REPOSITION to a place at an AMSL altitude, for a vehicle that flies HOLD.

    It does not ask for a change of mode (param2 bit 0). With that bit, a command that is under way while the pilot takes over or a
    failsafe begins would take the vehicle back to HOLD.
    """
    yaw = math.nan if yaw_ned_rad is None else yaw_ned_rad
    default_speed, no_change_of_mode = -1.0, 0.0
    return Command("reposition", REPOSITION, (default_speed, no_change_of_mode, 0.0, yaw), _e7(target))


def land_here() -> Command:
    """NAV_LAND: PX4 lands where it is, whatever position it is given."""
    return Command("land", LAND, (0.0, 0.0, 0.0, math.nan))


def position_target(
    target: GlobalPosition, velocity_ned_mps: Vector3, acceleration_ned_mps2: Vector3, yaw_ned_rad: float
) -> Any:
    """SET_POSITION_TARGET_GLOBAL_INT in frame 5 (AMSL).

    Frame 6 (relative to home) is not used: home moves, and PX4 has a sign fault in it where home and the EKF's origin differ.
    """
    latitude_e7, longitude_e7, altitude_amsl_m = _e7(target)
    vn, ve, vd = velocity_ned_mps
    return mavlink.MAVLink_set_position_target_global_int_message(
        0,
        0,
        0,
        mavlink.MAV_FRAME_GLOBAL_INT,
        USE_ALL_BUT_YAW_RATE,
        latitude_e7,
        longitude_e7,
        altitude_amsl_m,
        vn,
        ve,
        vd,
        *acceleration_ned_mps2,
        yaw_ned_rad,
        0.0,
    )


def _e7(target: GlobalPosition) -> tuple[int, int, float]:
    return round(target.latitude_deg * 1e7), round(target.longitude_deg * 1e7), target.altitude_amsl_m
