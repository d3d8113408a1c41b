"""The newest setpoint from outside, and whether it is fresh."""

from services.simulator.autopilot.parameters import Parameters
from services.simulator.autopilot.setpoint import NAN, OffboardSetpoint, Setpoint


class Offboard:
    """What OFFBOARD flies. Nothing confirms a setpoint; silence for COM_OF_LOSS_T is a loss."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._newest: OffboardSetpoint | None = None
        self._at_s = -1e9

    def take(self, setpoint: OffboardSetpoint, now_s: float) -> None:
        """A setpoint came."""
        self._newest, self._at_s = setpoint, now_s

    def fresh(self, now_s: float) -> bool:
        """Whether the stream is alive."""
        return now_s - self._at_s <= self._parameters["COM_OF_LOSS_T"]

    def lifts(self, down_m: float) -> bool:
        """Whether the setpoint asks a vehicle on the ground to rise."""
        newest = self._newest
        if newest is None:
            return False
        higher = newest.position is not None and newest.position[2] < down_m - 0.1
        return higher or (newest.position is None and newest.velocity is not None and newest.velocity[2] < -0.1)

    def setpoint(self) -> Setpoint:
        """What to fly."""
        ask = Setpoint()
        newest = self._newest
        if newest is None:
            return ask
        if newest.position is not None:
            ask.north, ask.east, ask.down = newest.position
        if newest.velocity is not None:
            ask.vn, ask.ve, ask.vd = newest.velocity
        ask.yaw = NAN if newest.yaw is None else newest.yaw
        ask.yaw_rate = newest.yaw_rate or 0.0
        return ask
