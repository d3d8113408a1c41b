"""What really is. Only the camera renderer, the recorder and the station's reports may read it."""

from schemas.message import GlobalPosition, Quaternion, Stamped, Vector3


class GroundTruth(Stamped):
    """The true pose of the vehicle and the true place of the pad."""

    vehicle_position: GlobalPosition
    """The body frame's origin."""
    velocity_ned_mps: Vector3
    """True velocity, north, east, down, m/s."""
    q_ned_body: Quaternion
    """True attitude, w, x, y, z."""
    angular_velocity_body_rps: Vector3
    """True rates about the body axes, rad/s."""
    pad_position: GlobalPosition
    """The pad's true centre."""
    pad_azimuth_rad: float
    """True azimuth of the print's upward direction, rad."""
    vehicle_from_pad_ned_m: Vector3
    """From the pad's centre to the vehicle's body origin, north, east, down, metres."""
    touching_ground: bool
    """Whether the landing gear touches the ground."""
