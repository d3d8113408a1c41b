"""Guidance `reposition`: Algorithm 1 of the paper, one DO_REPOSITION a second."""

from dataclasses import dataclass

from alight.runtime.clock import nanoseconds
from schemas.message import GlobalPosition
from schemas.settings.commander import RepositionSettings
from services.commander.altitude_laws import exponential_altitude_m, linear_altitude_m


@dataclass
class Reposition:
    """Gives the next setpoint when one is due."""

    settings: RepositionSettings
    next_ns: int = 0

    def is_due(self, now_ns: int) -> bool:
        """Whether a period has passed since the last setpoint."""
        return now_ns >= self.next_ns

    def target(
        self, pad: GlobalPosition, altitude_amsl_m: float, height_above_pad_m: float, now_ns: int
    ) -> GlobalPosition | None:
        """The next place to go to: above the pad, at the altitude that the law gives.

        Args:
            pad: The estimated pad.
            altitude_amsl_m: The vehicle's altitude, AMSL.
            height_above_pad_m: The vehicle's height above the pad.
            now_ns: The time, UTC ns; the next setpoint is due a period later.

        Returns:
            The setpoint; None at or below the switching height, where the landing mode has to take over.
        """
        if height_above_pad_m <= self.settings.switching_height_m:
            return None
        self.next_ns = now_ns + nanoseconds(self.settings.period_s)
        if self.settings.law == "exponential":
            altitude_m = exponential_altitude_m(
                altitude_amsl_m,
                height_above_pad_m,
                self.settings.switching_height_m,
                self.settings.beta0,
                self.settings.beta1,
            )
        else:
            altitude_m = linear_altitude_m(altitude_amsl_m, self.settings.alpha_mps, self.settings.period_s)
        separation_m = pad.ellipsoidal_height_m - pad.altitude_amsl_m
        return pad.model_copy(update={"altitude_amsl_m": altitude_m, "ellipsoidal_height_m": altitude_m + separation_m})
