"""From where, and which way, the camera looked at capture time."""

from dataclasses import dataclass

from alight.geometry.frames import ned_from_camera, q_body_camera
from alight.geometry.rotation import quaternion_multiply
from schemas.message import Quaternion, Vector3
from services.geolocator.pose_history import Pose


@dataclass(frozen=True)
class View:
    """The vehicle's pose and the camera's mount at one moment."""

    vehicle: Pose
    q_body_gimbal: Quaternion
    camera_in_body_m: Vector3

    @property
    def q_ned_camera(self) -> Quaternion:
        """Takes camera to NED coordinates."""
        return quaternion_multiply(self.vehicle.q_ned_body, q_body_camera(self.q_body_gimbal))

    def ned_of(self, p_camera_m: Vector3) -> Vector3:
        """A point in camera coordinates, from the vehicle in NED, metres (Eq. 1)."""
        return ned_from_camera(p_camera_m, self.vehicle.q_ned_body, self.q_body_gimbal, self.camera_in_body_m)
