"""A vehicle that hovers above the pad: the messages that a bench feeds the nodes with."""

import math

from alight.geometry.local import moved_by_ned
from alight.geometry.rotation import quaternion_from_euler
from alight.runtime.clock import NS_PER_S, nanoseconds
from schemas.message import GlobalPosition, Quaternion
from schemas.settings import Settings
from schemas.truth import GroundTruth
from schemas.vehicle import VehicleState

START_NS = 1_800_000_000 * NS_PER_S
PERIOD_NS = NS_PER_S // 30
PAD = GlobalPosition(latitude_deg=47.397742, longitude_deg=8.545594, altitude_amsl_m=489.4, ellipsoidal_height_m=489.4)
STILL = (0.0, 0.0, 0.0)
SWAY_PART = 0.1
"""Sideways, as a part of the height."""
SWAY_RAD = math.radians(2.0)


class Hover:
    """Sways a little around a point above the pad, one sample for each frame."""

    def __init__(self, height_m: float) -> None:
        self._height_m = height_m

    def time_ns(self, number: int) -> int:
        """Capture time of a frame, UTC ns."""
        return START_NS + number * PERIOD_NS

    def told_ns(self, number: int) -> int:
        """When the simulator tells where everything will be at a frame: a picture that is begun later would be left out. UTC ns."""
        return self.time_ns(number) - nanoseconds(Settings().simulator.lead_s)

    def truth(self, number: int) -> GroundTruth:
        """Where everything is at a frame."""
        sway_m = SWAY_PART * self._height_m
        north_m, east_m = sway_m * math.sin(0.1 * number), sway_m * math.cos(0.07 * number)
        from_pad_m = (north_m, east_m, -self._height_m)
        return GroundTruth(
            at_ns=self.time_ns(number),
            vehicle_position=moved_by_ned(PAD, from_pad_m),
            velocity_ned_mps=STILL,
            q_ned_body=self._attitude(number),
            angular_velocity_body_rps=STILL,
            pad_position=PAD,
            pad_azimuth_rad=0.0,
            vehicle_from_pad_ned_m=from_pad_m,
            touching_ground=False,
        )

    def state(self, number: int) -> VehicleState:
        """What a perfect autopilot says of it."""
        truth = self.truth(number)
        return VehicleState(
            at_ns=truth.at_ns,
            position=truth.vehicle_position,
            velocity_ned_mps=STILL,
            q_ned_body=truth.q_ned_body,
            angular_velocity_body_rps=STILL,
        )

    def _attitude(self, number: int) -> Quaternion:
        roll_rad, pitch_rad = SWAY_RAD * math.sin(0.13 * number), SWAY_RAD * math.cos(0.11 * number)
        w, x, y, z = quaternion_from_euler(roll_rad, pitch_rad, 0.3)
        return w, x, y, z
