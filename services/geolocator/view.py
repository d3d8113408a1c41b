"""From where, and which way, the camera looked at capture time."""

from typing import NamedTuple

from alight.geometry.flat_matrix import Flat3, flat_rotation, times
from alight.geometry.rotation import (
    quaternion_from_rotation_vector,
    quaternion_multiply,
    quaternion_normalised,
    rotated,
)
from schemas.message import Quaternion, Vector3
from services.geolocator.pose_history import Pose


class View(NamedTuple):
    """The vehicle's pose and the camera's at one moment."""

    vehicle: Pose
    q_ned_camera: Quaternion
    R_ned_camera: Flat3
    camera_ned_m: Vector3
    """From the vehicle to the camera, north, east, down, metres."""
    by_gimbal: bool
    """Whether the camera's orientation is what a gimbal reported."""

    def ned_of(self, p_camera_m: Vector3) -> Vector3:
        """A point in camera coordinates, from the vehicle in NED, metres (Eq. 1)."""
        north, east, down = times(self.R_ned_camera, p_camera_m)
        camera_n, camera_e, camera_d = self.camera_ned_m
        return (camera_n + north, camera_e + east, camera_d + down)

    def turned(self, turn_rad: Vector3) -> "View":
        """The same view with the vehicle and its camera turned by a rotation vector about north, east and down, rad."""
        turn = quaternion_from_rotation_vector(turn_rad)
        q_ned_camera = quaternion_normalised(quaternion_multiply(turn, self.q_ned_camera))
        q_ned_body = quaternion_normalised(quaternion_multiply(turn, self.vehicle.q_ned_body))
        vehicle, camera_ned_m = self.vehicle._replace(q_ned_body=q_ned_body), rotated(turn, self.camera_ned_m)
        return View(vehicle, q_ned_camera, flat_rotation(q_ned_camera), camera_ned_m, self.by_gimbal)


def view_from(vehicle: Pose, q_body_camera: Quaternion, camera_in_body_m: Vector3, *, by_gimbal: bool) -> View:
    """The view of a camera that sits there in the body frame, turned like that.

    Args:
        vehicle: Its pose.
        q_body_camera: Takes camera to body coordinates; unit quaternion.
        camera_in_body_m: Forward, right, down, metres.
        by_gimbal: Whether the orientation is what a gimbal reported.
    """
    q_ned_camera = quaternion_multiply(vehicle.q_ned_body, q_body_camera)
    R_ned_camera, camera_ned_m = flat_rotation(q_ned_camera), rotated(vehicle.q_ned_body, camera_in_body_m)
    return View(vehicle, q_ned_camera, R_ned_camera, camera_ned_m, by_gimbal)
