"""A hover as it is recorded: raw fixes and corners, with where the vehicle truly was."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import ValidationError

from alight.geometry.camera import PinholeCamera
from alight.geometry.local import ned_between
from alight.markers.layout import PadLayout, layout_from
from alight.runtime.clock import nanoseconds
from schemas import topics
from schemas.fix import PadFix
from schemas.message import GlobalPosition
from schemas.settings import Settings
from services.geolocator.camera_mount import CameraMount
from station.biases.cylindrical_fit import FitError
from station.biases.extrinsic_model import BelievedCamera, rotation_matrices
from station.biases.sightings import Array, Sightings, Track, unified
from station.flight_record import FlightRecord
from station.report.figures.static_records import StaticRecord

SETTLED_AFTER_S = 3.0
"""The first seconds of a recording are left out: the vehicle settles."""
_DECIMETRE_M = 0.1


@dataclass(frozen=True)
class RecordedHover:
    """One recording in the terms of the fits."""

    static: StaticRecord
    """Raw fixes about the hover's place. What the vehicle moved is taken off: each error is against the reference at capture."""
    sightings: Sightings
    camera: BelievedCamera
    pad_azimuth_rad: float
    """As the raw fixes have it, circular mean."""
    settings: Settings
    reference: Track
    """Of the vehicle from the surveyed place of the pad, north, east, down, metres, over UTC seconds from `epoch_ns`."""
    epoch_ns: int
    true_attitude: Track | None
    """Of simulated flights, q_ned_body."""
    record: FlightRecord
    most: int | None
    """Fixes taken at most."""

    def attitude_error_deg(self) -> Array | None:
        """By how much the autopilot's attitude is turned too far about north, east and down, (N, 3); None where the truth is not known."""
        if self.true_attitude is None:
            return None
        at_s = self.sightings.captured_s
        believed, true = (rotation_matrices(track.at(at_s)) for track in (self.sightings.attitude, self.true_attitude))
        R = np.einsum("nij,nkj->nik", believed, true)
        turned = [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]]
        return np.degrees(0.5 * np.column_stack(turned))


def read_hover(record: FlightRecord, surveyed_pad: GlobalPosition | None, most: int | None = None) -> RecordedHover:
    """Take a hover out of a recording.

    Args:
        record: The recording.
        surveyed_pad: Where the pad is known to lie: the reference is then the navigation solution (RTK is what is wanted). None for
            simulated flights: the reference is then the truth, with heights counted from the ground at home as the paper does.
        most: Fixes to take at most.

    Raises:
        FitError: In one line, if something that is needed is not in the recording.
    """
    settings, calibrations = _settings(record), record.messages(topics.CALIBRATION)
    states = record.messages(topics.VEHICLE_STATE)
    if not calibrations or not states:
        raise FitError("the recording has no calibration or no vehicle states")
    if any(state.measured for state in record.messages(topics.GIMBAL_STATE)):
        raise FitError("the camera was on a gimbal that reports angles: biases are fitted for a fixed mount")
    epoch_ns = states[0].at_ns
    reference = _reference(record, settings, surveyed_pad, epoch_ns)
    fixes = settled(record.messages(topics.PAD_FIX), epoch_ns)
    if not fixes:
        raise FitError("the recording has no fix of the pad")
    times_s = _seconds([state.at_ns for state in states], epoch_ns)
    attitude = Track(times_s, unified(np.array([state.q_ned_body for state in states])))
    mount = CameraMount(settings.geolocator.mount, settings.geolocator.lookup)
    lens = PinholeCamera.from_calibration(calibrations[0])
    return RecordedHover(
        static_record(fixes[:most], "raw", reference, epoch_ns),
        _sightings(record, layout_from(settings.pad), fixes[:most], (reference, attitude), epoch_ns),
        BelievedCamera(lens, mount.q_body_gimbal(epoch_ns), mount.camera_in_body_m),
        _mean_azimuth(fixes),
        settings,
        reference,
        epoch_ns,
        _true_attitude(record, epoch_ns),
        record,
        most,
    )


def settled(fixes: Sequence[PadFix], epoch_ns: int) -> list[PadFix]:
    """Those with a place, after the first seconds."""
    begin_ns = epoch_ns + nanoseconds(SETTLED_AFTER_S)
    return [fix for fix in fixes if fix.raw is not None and fix.captured_at_ns >= begin_ns]


def _true_attitude(record: FlightRecord, epoch_ns: int) -> Track | None:
    truths = record.messages(topics.GROUND_TRUTH)
    if not truths:
        return None
    q = unified(np.array([truth.q_ned_body for truth in truths]))
    return Track(_seconds([truth.at_ns for truth in truths], epoch_ns), q)


def static_record(
    fixes: Sequence[PadFix], which: Literal["raw", "corrected"], reference: Track, epoch_ns: int
) -> StaticRecord:
    """Fixes of one hover about its place, which is the mean of the reference to the decimetre.

    Args:
        fixes: With `raw` and `corrected`.
        which: Before or after the correction.
        reference: See `RecordedHover`.
        epoch_ns: From when its times count.
    """
    true_m = reference.at(_seconds([fix.captured_at_ns for fix in fixes], epoch_ns))
    measured_m = -np.array([getattr(fix, which).pad_ned_m for fix in fixes])
    place_m = np.round(true_m.mean(axis=0) / _DECIMETRE_M) * _DECIMETRE_M
    return StaticRecord(place_m, measured_m - true_m + place_m, true_m)


def _settings(record: FlightRecord) -> Settings:
    try:
        return Settings.model_validate(record.provenance.settings)
    except ValidationError as error:
        raise FitError(f"the recording's settings are of another version ({error.error_count()} keys)") from None


def _reference(record: FlightRecord, settings: Settings, surveyed_pad: GlobalPosition | None, epoch_ns: int) -> Track:
    if surveyed_pad is not None:
        states = record.messages(topics.VEHICLE_STATE)
        places = np.array([ned_between(surveyed_pad, state.position) for state in states])
        return Track(_seconds([state.at_ns for state in states], epoch_ns), places)
    truths = record.messages(topics.GROUND_TRUTH)
    if not truths:
        raise FitError("the recording has no ground truth: say with --pad-at where the pad lies, and fly with RTK")
    places = np.array([truth.vehicle_from_pad_ned_m for truth in truths], np.float64)
    places[:, 2] -= settings.simulator.pad.height_above_home_m
    return Track(_seconds([truth.at_ns for truth in truths], epoch_ns), places)


def _sightings(
    record: FlightRecord, layout: PadLayout, fixes: Sequence[PadFix], tracks: tuple[Track, Track], epoch_ns: int
) -> Sightings:
    """The corners of the pad's largest marker in the frames that gave a fix."""
    wanted = {fix.captured_at_ns for fix in fixes}
    largest = layout.markers[0]
    captured_ns, corners = [], []
    for detection in record.messages(topics.DETECTION):
        if detection.captured_at_ns not in wanted:
            continue
        for marker in detection.markers:
            if (marker.family, marker.id) == (largest.family, largest.id):
                captured_ns.append(detection.captured_at_ns)
                corners.append(marker.corners_px)
                break
    pixels = np.array(corners, float).reshape(-1, 4, 2)
    return Sightings(_seconds(captured_ns, epoch_ns), pixels, largest.corners_m(), *tracks)


def _mean_azimuth(fixes: Sequence[PadFix]) -> float:
    azimuths = [fix.raw.azimuth_rad for fix in fixes if fix.raw is not None]
    return math.atan2(sum(map(math.sin, azimuths)), sum(map(math.cos, azimuths)))


def _seconds(times_ns: Sequence[int], epoch_ns: int) -> Array:
    return np.asarray((np.array(times_ns, np.int64) - epoch_ns) * 1e-9, float)
