"""Ground truths over a pad, for what sees."""

from collections.abc import Callable

import pytest

from alight.geometry.rotation import quaternion_from_euler
from schemas.message import GlobalPosition, Vector3
from schemas.truth import GroundTruth

TruthAt = Callable[..., GroundTruth]

SOMEWHERE = GlobalPosition(latitude_deg=47.4, longitude_deg=8.5, altitude_amsl_m=500.0, ellipsoidal_height_m=500.0)


@pytest.fixture
def truth_at() -> TruthAt:
    """Makes the truth of a vehicle at a place over the pad (north, east, down from its centre), level and at rest by default."""

    def make(
        north_m: float,
        east_m: float,
        down_m: float,
        roll_pitch_yaw_rad: Vector3 = (0.0, 0.0, 0.0),
        velocity_ned_mps: Vector3 = (0.0, 0.0, 0.0),
        rates_rps: Vector3 = (0.0, 0.0, 0.0),
        pad_azimuth_rad: float = 0.0,
        at_ns: int = 1_000_000_000,
    ) -> GroundTruth:
        return GroundTruth(
            at_ns=at_ns,
            vehicle_position=SOMEWHERE,
            velocity_ned_mps=velocity_ned_mps,
            q_ned_body=quaternion_from_euler(*roll_pitch_yaw_rad),
            angular_velocity_body_rps=rates_rps,
            pad_position=SOMEWHERE,
            pad_azimuth_rad=pad_azimuth_rad,
            vehicle_from_pad_ned_m=(north_m, east_m, down_m),
            touching_ground=False,
        )

    return make
