"""Everything that a decision rests on, as of one moment."""

import math
from typing import NamedTuple

from schemas.estimate import PadEstimate
from schemas.mission import Phase, Verb
from schemas.settings.commander import CommanderSettings
from schemas.vehicle import FlightMode, LandedState, VehicleState, VehicleStatus
from services.commander.carried_pad import CarriedPad
from services.commander.command_queue import Outcome


class Situation(NamedTuple):
    """An immutable look around. Ages are None where the thing never came."""

    now_ns: int
    settings: CommanderSettings
    phase: Phase
    code: str
    """Why the phase began."""
    phase_age_s: float
    link_silence_s: float | None
    """Since anything came from the autopilot, seconds."""
    status: VehicleStatus
    state: VehicleState | None
    state_age_s: float | None
    """Now minus the autopilot's sample time, seconds."""
    estimate: PadEstimate | None
    """The newest estimate that passed the gate."""
    pad: CarriedPad | None
    """That estimate, carried on to now."""
    estimate_age_s: float | None
    """Now minus the capture time of that estimate, seconds."""
    estimates_good_for_s: float
    """For how long estimates have come without a gap, seconds."""
    height_above_pad_m: float | None
    distance_to_pad_m: float | None
    distance_to_start_m: float | None
    """To the point where the landing shall start; None if none was named."""
    deaf_for_s: float | None = None
    """For how long somebody may have changed the mode unheard, seconds; None if the mode is known as of now."""
    asked: Verb | None = None
    """A request that was accepted and waits to take effect."""
    landing: bool = False
    """Whether a LAND request is being carried out."""
    first_look: bool = False
    """Whether this is the first time since the start of the process that the vehicle's state is known."""
    rebooted: bool = False
    """Whether the autopilot has booted anew since the phase began."""
    was_armed: bool = False
    """Whether the vehicle has been armed since the phase began."""
    climbing_asked: bool = False
    """Whether the takeoff command has been sent."""
    climb_left_m: float | None = None
    """How far below the height of the takeoff the vehicle is; None if that or its place is not known."""
    mode_taken: bool = False
    """Whether a mode is flown that the commander did not ask for."""
    expected_modes: tuple[FlightMode, ...] = ()
    mode_overdue_s: float | None = None
    """How long the mode that was asked for has not been flown, seconds; None if nothing is awaited."""
    recovering: bool = False
    """Whether a failsafe for want of our own setpoints is being left, because somebody asked."""
    refusal: Outcome | None = None
    """The command that was refused for good in this phase."""
    setpoint_gap_s: float = 0.0
    """The longest pause between OFFBOARD setpoints of late, the present one included, seconds."""
    funnel_closed_for_s: float = 0.0
    holds: int = 0
    """Holds for want of estimates during this landing."""

    @property
    def deaf(self) -> bool:
        """Whether somebody may have changed the mode since the autopilot was last heard to name it: then no mode is asked for."""
        return self.deaf_for_s is not None

    @property
    def airborne(self) -> bool:
        """Armed and not known to stand on the ground."""
        return self.status.armed and self.status.landed_state is not LandedState.ON_GROUND

    @property
    def stale_after_s(self) -> float:
        """How old an estimate may be with the guidance in use, seconds."""
        settings = self.settings
        return settings.stale_after_s if settings.guidance == "glide" else settings.reposition_stale_after_s

    @property
    def switching_height_m(self) -> float:
        """Where the descent becomes the touchdown, metres above the pad."""
        settings = self.settings
        section = settings.glide if settings.guidance == "glide" else settings.reposition
        return section.switching_height_m

    @property
    def failsafe_active(self) -> bool:
        """The autopilot says so, or flies another mode than the one that was last asked of it."""
        status = self.status
        overridden = status.intended_mode is not FlightMode.UNKNOWN and status.mode is not status.intended_mode
        return status.failsafe or (status.armed and overridden)

    @property
    def speed_mps(self) -> float:
        """Speed over all axes, m/s; 0 where it is unknown."""
        if self.state is None:
            return 0.0
        return math.hypot(*self.state.velocity_ned_mps)
