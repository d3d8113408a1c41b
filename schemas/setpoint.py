"""What the commander asked of the autopilot's position guidance."""

from enum import StrEnum

from schemas.message import GlobalPosition, Nanoseconds, ShortText, Traced, Vector3


class SetpointKind(StrEnum):
    """By which MAVLink message the setpoint went out."""

    OFFBOARD = "offboard"
    """SET_POSITION_TARGET_GLOBAL_INT."""
    REPOSITION = "reposition"
    """MAV_CMD_DO_REPOSITION."""


class Setpoint(Traced):
    """One setpoint; `captured_at_ns` is that of the frame that caused it (of the estimate steered by)."""

    kind: SetpointKind
    """The way it went to the autopilot."""
    sent_at_ns: Nanoseconds
    """When the commander decided it, UTC ns."""
    fresh: bool
    """True if a new estimate caused it, False if it repeats or advances an earlier one."""
    position: GlobalPosition
    """The point asked for."""
    yaw_ned_rad: float | None = None
    """Heading asked for, from north, clockwise, rad; None leaves it to the autopilot."""
    velocity_ned_mps: Vector3 | None = None
    """Velocity sent along, north, east, down, m/s; None where none was sent."""
    reason: ShortText = ""
    """The mission phase that asked for it."""

    @property
    def stamp_ns(self) -> int:
        """The time of sending: many setpoints follow from one frame."""
        return self.sent_at_ns
