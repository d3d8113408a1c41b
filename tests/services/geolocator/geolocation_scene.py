"""A pad, a vehicle above it, and what an honest camera and detector make of them: for the tests of the geolocator."""

import math
from dataclasses import dataclass, field

import cv2
import numpy as np

from alight.geometry.camera import PinholeCamera
from alight.geometry.frames import camera_from_ned, q_body_camera
from alight.geometry.local import moved_by_ned, ned_between
from alight.geometry.rotation import (
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_from_R,
    quaternion_multiply,
    rotated,
)
from alight.markers.pad_pose import mean_side_px
from alight.runtime.node import Arrival
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.detection import Detection, Marker, MarkerPose
from schemas.message import GlobalPosition
from schemas.settings import Settings
from schemas.vehicle import VehicleState
from services.geolocator.service import build

T0_NS = 1_767_225_600_000_000_000
MS = 1_000_000
CALIBRATION = CameraCalibration(
    at_ns=T0_NS, width_px=640, height_px=480, fx_px=293.35, fy_px=293.31, cx_px=319.64, cy_px=239.64,
    distortion=(16.44e-4, 35.89e-4, 6.35e-4, -6.35e-4, 100.7e-4),
)  # fmt: skip
CAMERA = PinholeCamera.from_calibration(CALIBRATION)
HOME = GlobalPosition(latitude_deg=47.397742, longitude_deg=8.545594, altitude_amsl_m=489.4, ellipsoidal_height_m=536.9)
HALF = 0.5
SQUARE = ((-HALF, HALF, 0.0), (HALF, HALF, 0.0), (HALF, -HALF, 0.0), (-HALF, -HALF, 0.0))
POSE_SIGMA = (0.02, 0.02, 0.05, 0.02, 0.02, 0.005)


@dataclass(frozen=True)
class Scene:
    """The truth: the pad lies at HOME."""

    vehicle_ned_m: tuple[float, float, float] = (1.0, -2.0, -10.0)
    q_ned_body: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    pad_azimuth_rad: float = 0.0
    velocity_ned_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rates_body_rps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    q_body_gimbal: tuple[float, float, float, float] = field(default=quaternion_from_euler(0.0, -math.pi / 2, 0.0))

    @property
    def vehicle_position(self):
        return moved_by_ned(HOME, self.vehicle_ned_m)

    @property
    def pad_from_vehicle_m(self):
        return tuple(ned_between(self.vehicle_position, HOME).tolist())

    @property
    def q_ned_marker(self):
        return quaternion_from_R(
            np.array(
                [
                    [-math.sin(self.pad_azimuth_rad), math.cos(self.pad_azimuth_rad), 0.0],
                    [math.cos(self.pad_azimuth_rad), math.sin(self.pad_azimuth_rad), 0.0],
                    [0.0, 0.0, -1.0],
                ]
            )
        )

    def state(self, at_ns, **changes):
        """The vehicle state at a time, T0 being the scene's: it moves on steadily from there."""
        ahead_s = (at_ns - T0_NS) * 1e-9
        moved = tuple(v * ahead_s for v in self.velocity_ned_mps)
        fields = {
            "at_ns": at_ns,
            "position": moved_by_ned(self.vehicle_position, moved),
            "velocity_ned_mps": self.velocity_ned_mps,
            "q_ned_body": self.q_ned_body,
            "angular_velocity_body_rps": self.rates_body_rps,
        }
        return VehicleState(**(fields | changes))

    def corners_camera_m(self):
        """The print's corners in the camera frame."""
        pad = np.array(self.pad_from_vehicle_m)
        points = [pad + rotated(self.q_ned_marker, corner) for corner in SQUARE]
        return np.array([camera_from_ned(p, self.q_ned_body, self.q_body_gimbal) for p in points])

    def true_pose(self, sigma=POSE_SIGMA):
        """What a perfect detector would say."""
        q_ned_camera = quaternion_multiply(self.q_ned_body, q_body_camera(self.q_body_gimbal))
        return MarkerPose(
            position_camera_m=camera_from_ned(self.pad_from_vehicle_m, self.q_ned_body, self.q_body_gimbal),
            q_camera_marker=quaternion_multiply(quaternion_conjugate(q_ned_camera), self.q_ned_marker),
            reprojection_error_px=0.1,
            covariance=diagonal(sigma),
        )

    def marker(self, *poses, **changes):
        """The pad's marker with the given poses, the true one by default."""
        corners = CAMERA.project(self.corners_camera_m())
        fields = {
            "family": "5x5_1000",
            "id": 68,
            "side_m": 1.0,
            "corners_px": tuple(map(tuple, corners.tolist())),
            "corner_sigma_px": 0.3,
            "poses": poses or (self.true_pose(),),
            "ambiguity": 0.5,
        }
        return Marker(**(fields | changes))

    def ippe_marker(self, generator, sigma_px, camera=CAMERA, grown_px=0.0):
        """The marker as IPPE sees it through noisy corners, a camera that need not be the one that is believed, and blur that makes its
        sides longer."""
        true = camera.project(self.corners_camera_m())
        grown = grown_px / mean_side_px(true.tolist()) * (true - true.mean(axis=0))
        corners = true + grown + generator.normal(0.0, sigma_px, (4, 2))
        rays = CAMERA.undistorted(corners)
        _, turns, shifts, _ = cv2.solvePnPGeneric(
            np.array(SQUARE), rays, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE_SQUARE
        )
        poses = sorted(
            (ippe_pose(turn, shift, corners, sigma_px) for turn, shift in zip(turns, shifts, strict=True)),
            key=lambda pose: pose.reprojection_error_px,
        )
        return self.marker(*poses, corners_px=tuple(map(tuple, corners.tolist())), corner_sigma_px=sigma_px)


def ippe_pose(turn, shift, corners, sigma_px):
    """One planar solution with its first-order covariance from the corner noise."""
    R, _ = cv2.Rodrigues(turn)
    position = shift.ravel()

    def corners_at(x):
        small, _ = cv2.Rodrigues(x[3:])
        return CAMERA.project((small @ R @ np.array(SQUARE).T).T + position + x[:3]).ravel()

    J = np.column_stack([(corners_at(e) - corners_at(-e)) / 2e-6 for e in np.eye(6) * 1e-6])
    residual = corners_at(np.zeros(6)).reshape(4, 2) - corners
    C = sigma_px**2 * np.linalg.inv(J.T @ J)
    return MarkerPose(
        position_camera_m=tuple(position.tolist()),
        q_camera_marker=quaternion_from_R(R),
        reprojection_error_px=float(np.sqrt(np.mean(np.sum(residual**2, axis=1)))),
        covariance=tuple(((C + C.T) / 2).ravel().tolist()),
    )


def diagonal(sigma):
    return tuple(np.diag(np.square(sigma)).ravel().tolist())


def detection(*markers, at_ns=T0_NS, hops=()):
    return Detection(captured_at_ns=at_ns, hops=hops, frame_sequence=1, detector="test", markers=markers)


def geolocator(calibration=CALIBRATION, **settings):
    """A node as the service builds it, with a calibration unless told otherwise."""
    node = build(Settings(geolocator=settings))
    if calibration is not None:
        tell(node, topics.CALIBRATION, calibration)
    return node


def tell(node, topic, message, now_ns=T0_NS + 40 * MS):
    """Hand a node one message; returns what it publishes."""
    return [output.message for output in node.on_message(Arrival(topic, message, now_ns, now_ns))]


def show(node, *markers, at_ns=T0_NS, **others):
    """Hand it a detection; returns the fix."""
    (fix,) = tell(node, topics.DETECTION, detection(*markers, at_ns=at_ns, **others), now_ns=at_ns + 40 * MS)
    return fix


def fly(node, scene, *times_ms):
    """Hand it the scene's vehicle states at times relative to T0."""
    for time_ms in times_ms:
        tell(node, topics.VEHICLE_STATE, scene.state(T0_NS + time_ms * MS))
