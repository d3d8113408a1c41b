"""Whether the vehicle stands on the ground, and when to believe it."""

from services.simulator.autopilot.parameters import Parameters
from services.simulator.estimator import Estimate

CONTACT_S = 1.3
"""How long a commanded descent must lead nowhere before it counts as ground contact; from then on the thrust is cut."""
LANDED_S = 1.8
"""How long contact lasts before the vehicle counts as landed."""
PUSHING_DOWN_MPS2 = 0.5
"""The controller must be pressing: thrust below hover by this acceleration."""
CLOSE_TO_GROUND_M = 1.0


class LandDetector:
    """PX4's chain: a descent is commanded, nothing moves, the thrust is low: contact, then landed.

    A descent must be commanded as a velocity: holding a position on or below the ground never counts, as in PX4.
    """

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self.landed = True
        self._still_s = 0.0
        self._contact_s = 0.0

    @property
    def contact(self) -> bool:
        """Ground contact: cut the thrust."""
        return not self.landed and self._still_s >= CONTACT_S

    def take_off(self) -> None:
        """The motors have begun to lift."""
        self.landed = False
        self._still_s = self._contact_s = 0.0

    def land_at_once(self) -> None:
        """The motors are off: whatever the vehicle does, it does not fly."""
        self.landed = True

    def step(self, asked_down_mps: float, asked_down_mps2: float, estimate: Estimate, step_s: float) -> bool:
        """Look at one step in the air.

        Args:
            asked_down_mps: Velocity setpoint of the flight mode, NaN for none.
            asked_down_mps2: Acceleration that the position controller asks for.
            estimate: The navigation solution.
            step_s: Time step.

        Returns:
            Whether the vehicle has just been found landed.
        """
        threshold = self._parameters["LNDMC_Z_VEL_MAX"]
        still = abs(estimate.vd) < threshold and estimate.height_above_ground_m < CLOSE_TO_GROUND_M
        if self.contact:
            if abs(estimate.vd) > 2.0 * threshold:
                self._still_s = self._contact_s = 0.0
                return False
            self._contact_s += step_s
            self.landed = self._contact_s >= LANDED_S
            return self.landed
        pressing = asked_down_mps >= 1.1 * threshold and asked_down_mps2 > PUSHING_DOWN_MPS2
        self._still_s = self._still_s + step_s if still and pressing else 0.0
        return False
