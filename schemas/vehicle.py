"""What the autopilot says of the vehicle."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from schemas.message import GlobalPosition, Quaternion, ShortText, Stamped, Vector3


class VehicleState(Stamped):
    """The vehicle's pose; `at_ns` is the autopilot's sample time brought to UTC by TIMESYNC."""

    position: GlobalPosition
    """The body frame's origin."""
    velocity_ned_mps: Vector3
    """Velocity, north, east, down, m/s."""
    q_ned_body: Quaternion
    """Attitude: takes body (forward, right, down) to NED coordinates; w, x, y, z."""
    angular_velocity_body_rps: Vector3
    """Rates about the body axes, rad/s."""
    clock_uncertainty_s: Annotated[float, Field(ge=0.0)] = 0.0
    """Half of the TIMESYNC round trip: how wrong `at_ns` may be, seconds."""


class FlightMode(StrEnum):
    """PX4's flight modes as far as they matter here. Anything else is OTHER, and means: hands off."""

    MANUAL = "manual"
    ALTITUDE = "altitude"
    POSITION = "position"
    HOLD = "hold"
    MISSION = "mission"
    TAKEOFF = "takeoff"
    LAND = "land"
    RETURN = "return"
    PRECISION_LAND = "precision_land"
    OFFBOARD = "offboard"
    OTHER = "other"
    UNKNOWN = "unknown"


class LandedState(StrEnum):
    """MAV_LANDED_STATE."""

    UNDEFINED = "undefined"
    ON_GROUND = "on_ground"
    IN_AIR = "in_air"
    TAKING_OFF = "taking_off"
    LANDING = "landing"


class VehicleStatus(Stamped):
    """What the autopilot is doing; published at 5 Hz and on every change."""

    connected: bool
    """Whether a heartbeat came within the link's timeout."""
    armed: bool = False
    """Whether the motors may turn."""
    mode: FlightMode = FlightMode.UNKNOWN
    """The flight mode that is flown."""
    intended_mode: FlightMode = FlightMode.UNKNOWN
    """The mode last asked for; differs from `mode` while a failsafe is flown (CURRENT_MODE)."""
    custom_mode: Annotated[int, Field(ge=0)] = 0
    """PX4's raw custom_mode."""
    landed_state: LandedState = LandedState.UNDEFINED
    """Ground or air (EXTENDED_SYS_STATE)."""
    failsafe: bool = False
    """MAV_STATE critical or worse: the autopilot flies a failsafe of its own."""
    ready_to_arm: bool = False
    """MAV_STATE standby and the pre-arm checks pass."""
    home: GlobalPosition | None = None
    """HOME_POSITION. PX4 moves it at arming, takeoff and landing: freeze it before relying on it."""
    battery_remaining: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    """Remaining charge, 0 to 1."""
    last_text: ShortText = ""
    """The newest STATUSTEXT."""


UNKNOWN_ROTATION: Quaternion = (0.0, 0.0, 0.0, 0.0)
"""No rotation at all: what stands for one that nobody knows."""


class GimbalState(Stamped):
    """How the camera's gimbal is turned. A fixed mount is the constant that the settings give."""

    q_body_gimbal: Quaternion
    """Takes gimbal coordinates (x along the optical axis, y right, z down) to body coordinates; w, x, y, z. All zero if there is a gimbal
    and how it is turned is not known: nobody may take it for a fixed mount then."""
    measured: bool
    """True if a gimbal device reported it, False if it is the fixed mount from the settings."""
