"""A pilot's sticks (MANUAL_CONTROL), flown as position mode: deflection is velocity."""

import math

from services.simulator.autopilot.parameters import Parameters
from services.simulator.autopilot.setpoint import Setpoint
from services.simulator.estimator import Estimate

LOSS_S = 0.5
"""COM_RC_LOSS_T of PX4."""
DEADBAND = 0.1
YAW_RATE_RPS = math.radians(100.0)


class Sticks:
    """The newest deflections, -1 to 1, and the position held while they are centred."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._at_s = -1e9
        self._forward = self._right = self._up = self._turn = 0.0
        self._held: tuple[float, float] | None = None
        self._held_down: float | None = None

    @property
    def turning(self) -> bool:
        """Whether the yaw stick is deflected."""
        return self._turn != 0.0

    def take(self, forward: float, right: float, up: float, turn: float, now_s: float) -> None:
        """Deflections came; `up` is 0 in the middle."""
        self._forward, self._right, self._up, self._turn = (
            value if abs(value) > DEADBAND else 0.0 for value in (forward, right, up, turn)
        )
        self._at_s = now_s

    def fresh(self, now_s: float) -> bool:
        """Whether a pilot is there."""
        return now_s - self._at_s <= LOSS_S

    def lifts(self, now_s: float) -> bool:
        """Whether the pilot pulls up."""
        return self.fresh(now_s) and self._up > 0.3

    def setpoint(self, estimate: Estimate) -> Setpoint:
        """What to fly."""
        ask = Setpoint(yaw_rate=self._turn * YAW_RATE_RPS)
        value = self._parameters
        if self._forward or self._right:
            cos_yaw, sin_yaw = math.cos(estimate.yaw), math.sin(estimate.yaw)
            speed = value["MPC_VEL_MANUAL"]
            ask.vn = speed * (self._forward * cos_yaw - self._right * sin_yaw)
            ask.ve = speed * (self._forward * sin_yaw + self._right * cos_yaw)
            self._held = None
        else:
            self._held = self._held or (estimate.north, estimate.east)
            ask.north, ask.east = self._held
        if self._up:
            ask.vd = -self._up * (value["MPC_Z_VEL_MAX_UP"] if self._up > 0.0 else value["MPC_Z_VEL_MAX_DN"])
            self._held_down = None
        else:
            self._held_down = estimate.down if self._held_down is None else self._held_down
            ask.down = self._held_down
        return ask

    def release(self) -> None:
        """The mode ended: what was held is no longer held."""
        self._held = self._held_down = None
