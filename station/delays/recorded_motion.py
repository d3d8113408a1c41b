"""A recorded flight in view of the pad, as the delay fit wants it."""

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
from pydantic import ValidationError

from alight.geometry.camera import PinholeCamera
from alight.geometry.circular import circular_median
from alight.geometry.local import ned_between
from alight.markers.layout import PlacedMarker, layout_from
from schemas import topics
from schemas.detection import Detection
from schemas.fix import PadFix
from schemas.message import GlobalPosition
from schemas.settings import Settings
from schemas.vehicle import VehicleState
from services.geolocator.camera_mount import CameraMount
from station.biases.extrinsic_model import BelievedCamera
from station.biases.sightings import Array, Sightings, Track, unified
from station.delays.delay_fit import SEARCHED_S, DelayError, Motion
from station.flight_record import FlightRecord

LEAST_HEIGHT_M = 2.0
"""Nearer than this an error of the pad's place moves it in the picture as a delay would."""


def flown_settings(record: FlightRecord) -> Settings:
    """The settings of a recorded flight.

    Raises:
        DelayError: If they are of another version.
    """
    try:
        return Settings.model_validate(record.provenance.settings)
    except ValidationError as error:
        raise DelayError(f"the recording's settings are of another version ({error.error_count()} keys)") from None


def read_motion(record: FlightRecord) -> tuple[Motion, BelievedCamera]:
    """Take the pad's motion and the vehicle's out of a recording.

    Raises:
        DelayError: In one line, if something that is needed is not in the recording.
    """
    settings = flown_settings(record)
    states, calibrations = record.messages(topics.VEHICLE_STATE), record.messages(topics.CALIBRATION)
    fixes = [fix for fix in record.messages(topics.PAD_FIX) if fix.raw is not None]
    if not states or not calibrations or not fixes:
        raise DelayError("the recording has no vehicle states, no calibration or no fix of the pad")
    if any(state.measured for state in record.messages(topics.GIMBAL_STATE)):
        raise DelayError("the camera was on a gimbal that reports angles: the delay is found with a fixed mount")
    mount = CameraMount(settings.geolocator.mount, settings.geolocator.lookup)
    camera = BelievedCamera(
        PinholeCamera.from_calibration(calibrations[0]), mount.q_body_gimbal(states[0].at_ns), mount.camera_in_body_m
    )
    position, attitude = _tracks(states, _pad_place(fixes))
    captured_s, corners_px, marker = _seen(record, settings, position)
    azimuth_deg = math.degrees(circular_median([fix.raw.azimuth_rad for fix in fixes if fix.raw is not None]))
    return Motion(Sightings(captured_s, corners_px, marker.corners_m(), position, attitude), azimuth_deg), camera


def _pad_place(fixes: Sequence[PadFix]) -> GlobalPosition:
    """The median of the raw fixes."""
    places = [fix.raw.position for fix in fixes if fix.raw is not None]
    latitude_deg, longitude_deg, amsl_m, height_m = np.median(
        [(one.latitude_deg, one.longitude_deg, one.altitude_amsl_m, one.ellipsoidal_height_m) for one in places], axis=0
    )
    return GlobalPosition(
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        altitude_amsl_m=amsl_m,
        ellipsoidal_height_m=height_m,
    )


def _tracks(states: Sequence[VehicleState], pad: GlobalPosition) -> tuple[Track, Track]:
    """Position from the pad and attitude, over seconds from the first state."""
    times_s = np.array([(state.at_ns - states[0].at_ns) * 1e-9 for state in states])
    places = np.array([ned_between(pad, state.position) for state in states])
    return Track(times_s, places), Track(times_s, unified(np.array([state.q_ned_body for state in states])))


def _seen(record: FlightRecord, settings: Settings, position: Track) -> tuple[Array, Array, PlacedMarker]:
    """Capture times, corners (N, 4, 2), and which marker they are of: the one that was seen most often."""
    epoch_ns = record.messages(topics.VEHICLE_STATE)[0].at_ns
    places = {(marker.family, marker.id): marker for marker in layout_from(settings.pad).markers}
    detections = record.messages(topics.DETECTION)
    counts = Counter(
        (marker.family, marker.id)
        for detection in detections
        for marker in detection.markers
        if (marker.family, marker.id) in places
    )
    if not counts:
        raise DelayError("no marker of the pad was seen")
    name, _ = counts.most_common(1)[0]
    times_s, corners = _corners_of(name, detections, epoch_ns)
    known = (times_s - SEARCHED_S[1] >= position.times_s[0]) & (times_s - SEARCHED_S[0] <= position.times_s[-1])
    high = -position.at(times_s)[:, 2] >= LEAST_HEIGHT_M
    return times_s[known & high], corners[known & high], places[name]


def _corners_of(name: tuple[str, int], detections: Sequence[Detection], epoch_ns: int) -> tuple[Array, Array]:
    times_s, corners = [], []
    for detection in detections:
        for marker in detection.markers:
            if (marker.family, marker.id) == name:
                times_s.append((detection.captured_at_ns - epoch_ns) * 1e-9)
                corners.append(marker.corners_px)
                break
    return np.array(times_s), np.array(corners, np.float64).reshape(-1, 4, 2)
