"""Where the pad should appear in a picture: by the estimate, and by the truth."""

import math
from bisect import bisect_right
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from alight.geometry.camera import PinholeCamera
from alight.geometry.frames import camera_from_ned
from alight.geometry.local import moved_by_ned, ned_between
from alight.geometry.rotation import quaternion_from_euler, quaternion_multiply, slerp
from alight.markers.family import FamilyError
from alight.markers.layout import LayoutError, layout_from
from alight.runtime.clock import nanoseconds, seconds
from schemas import topics
from schemas.message import GlobalPosition, Quaternion, Vector3
from schemas.settings import Settings
from schemas.vehicle import UNKNOWN_ROTATION
from services.camera.simulated_camera import true_camera
from services.camera.viewpoint import R_ned_marker, Viewpoint, mount_rotation
from station.flight_record import FlightRecord

Corners = NDArray[np.float64]

_FARTHEST_NS = nanoseconds(0.2)
"""What is further than this from the capture says nothing about it."""
_OLDEST_ESTIMATE_NS = nanoseconds(2.0)


class Overlay:
    """Projects markers of the pad into the pictures of one flight.

    Markers are given by their corners in the pad's frame (x right, y up in the print), (N, 4, 3) metres; what comes back are
    distorted pixels, (N, 4, 2).
    """

    def __init__(self, record: FlightRecord) -> None:
        try:
            self._settings = Settings.model_validate(record.provenance.settings or {})
        except ValidationError:
            self._settings = Settings()
        self._calibrations = record.messages(topics.CALIBRATION)
        self._states = sorted(record.messages(topics.VEHICLE_STATE), key=lambda state: state.at_ns)
        self._state_times_ns = [state.at_ns for state in self._states]
        self._gimbals = [
            state
            for state in record.messages(topics.GIMBAL_STATE)
            if state.measured and state.q_body_gimbal != UNKNOWN_ROTATION
        ]
        self._truths = record.messages(topics.GROUND_TRUTH)
        self._truth_times_ns = [truth.at_ns for truth in self._truths]
        self._estimates = sorted(record.messages(topics.PAD_ESTIMATE), key=lambda one: one.captured_at_ns)
        self._estimate_times_ns = [one.captured_at_ns for one in self._estimates]
        self._fixes = {fix.captured_at_ns: fix for fix in record.messages(topics.PAD_FIX)}

    def by_truth(self, captured_at_ns: int, markers_m: Corners) -> Corners | None:
        """Through the true camera, from the ground truth; None where there is none."""
        light_ns = captured_at_ns - nanoseconds(self._settings.simulator.installation.image_latency_s)
        index = _nearest(self._truth_times_ns, light_ns)
        if index is None or not self._calibrations:
            return None
        truth, installation = self._truths[index], self._settings.simulator.installation
        viewpoint = Viewpoint.from_truth(truth, mount_rotation(installation), seconds(light_ns - truth.at_ns))
        print_m = installation.pad_scale * markers_m.reshape(-1, 3)
        lens = true_camera(self._calibrations[-1], installation.lens_scale)
        return _whole(lens.project(viewpoint.in_camera(print_m)))

    def by_estimate(self, captured_at_ns: int, markers_m: Corners) -> Corners | None:
        """Where the newest estimate until then has the pad, through the camera as it is believed to be.

        What the correction took off this frame's fix is put back, for the picture shows the camera as it is installed.
        """
        newest = bisect_right(self._estimate_times_ns, captured_at_ns) - 1
        pose = self._pose(captured_at_ns)
        if newest < 0 or pose is None or not self._calibrations:
            return None
        estimate = self._estimates[newest]
        if captured_at_ns - estimate.captured_at_ns > _OLDEST_ESTIMATE_NS:
            return None
        place, q_ned_body = pose
        azimuth_rad, pad_ned_m = estimate.azimuth_rad, ned_between(place, estimate.position)
        fix = self._fixes.get(captured_at_ns)
        if fix is not None and fix.raw is not None and fix.corrected is not None:
            azimuth_rad += fix.raw.azimuth_rad - fix.corrected.azimuth_rad
            pad_ned_m = pad_ned_m + np.subtract(fix.raw.pad_ned_m, fix.corrected.pad_ned_m)
        corners_ned_m = pad_ned_m + markers_m.reshape(-1, 3) @ R_ned_marker(azimuth_rad).T
        q_body_gimbal, at_m = self._mount(captured_at_ns)
        in_camera_m = [camera_from_ned(corner, q_ned_body, q_body_gimbal, at_m) for corner in corners_ned_m]
        return _whole(PinholeCamera.from_calibration(self._calibrations[-1]).project(np.array(in_camera_m)))

    def _pose(self, at_ns: int) -> tuple[GlobalPosition, Quaternion] | None:
        after = bisect_right(self._state_times_ns, at_ns)
        if not 0 < after < len(self._states):
            return None
        earlier, later = self._states[after - 1], self._states[after]
        if later.at_ns - earlier.at_ns > _FARTHEST_NS:
            return None
        fraction = (at_ns - earlier.at_ns) / (later.at_ns - earlier.at_ns)
        north, east, down = (fraction * ned_between(earlier.position, later.position)).tolist()
        return moved_by_ned(earlier.position, (north, east, down)), slerp(
            earlier.q_ned_body, later.q_ned_body, fraction
        )

    def _mount(self, at_ns: int) -> tuple[Quaternion, Vector3]:
        mount = self._settings.geolocator.mount
        index = _nearest([state.at_ns for state in self._gimbals], at_ns)
        nominal = (
            _from_degrees(mount.roll_deg, mount.pitch_deg, mount.yaw_deg)
            if index is None
            else self._gimbals[index].q_body_gimbal
        )
        turned = _from_degrees(mount.misalignment_roll_deg, mount.misalignment_pitch_deg, mount.misalignment_yaw_deg)
        return quaternion_multiply(turned, nominal), (mount.forward_m, mount.right_m, mount.down_m)


def marker_places(record: FlightRecord) -> Mapping[tuple[str, int], Corners]:
    """Corners of each marker of the flight's pad by family and number, (4, 3), pad frame, metres; empty if they are unknown."""
    try:
        settings = Settings.model_validate(record.provenance.settings or {})
        placed = layout_from(settings.pad).markers
    except (ValidationError, LayoutError, FamilyError):
        return {}
    return {(marker.family, marker.id): marker.corners_m() for marker in placed}


def _nearest(times_ns: Sequence[int], at_ns: int) -> int | None:
    after = bisect_right(times_ns, at_ns)
    beside = [index for index in (after - 1, after) if 0 <= index < len(times_ns)]
    best = min(beside, key=lambda index: abs(times_ns[index] - at_ns), default=None)
    return best if best is not None and abs(times_ns[best] - at_ns) <= _FARTHEST_NS else None


def _whole(corners_px: Corners) -> Corners | None:
    return corners_px.reshape(-1, 4, 2) if np.all(np.isfinite(corners_px)) else None


def _from_degrees(roll_deg: float, pitch_deg: float, yaw_deg: float) -> Quaternion:
    return quaternion_from_euler(math.radians(roll_deg), math.radians(pitch_deg), math.radians(yaw_deg))
