"""One geolocated measurement of the pad."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from schemas.message import GlobalPosition, Matrix3, Part, ShortText, Traced, Vector3


class FixVerdict(StrEnum):
    """What became of a detection. Only ACCEPTED may steer."""

    ACCEPTED = "accepted"
    NO_MARKER = "no_marker"
    """The pad's marker is not among those seen."""
    NO_CALIBRATION = "no_calibration"
    """No camera calibration has come yet."""
    NO_VEHICLE_STATE = "no_vehicle_state"
    """No vehicle pose has come yet."""
    POSE_TOO_OLD = "pose_too_old"
    """The newest vehicle pose is too long before the capture to extrapolate."""
    POSE_GAP = "pose_gap"
    """The poses around the capture are too far apart to interpolate."""
    CAPTURE_BEFORE_HISTORY = "capture_before_history"
    """The capture is older than the pose history."""
    BEHIND_CAMERA = "behind_camera"
    """The pose puts the pad behind the camera."""
    NOT_LEVEL = "not_level"
    """Neither planar solution shows a level pad."""
    ABOVE_VEHICLE = "above_vehicle"
    """The pad would lie above the vehicle."""
    NOT_FINITE = "not_finite"
    """The chain yielded NaN or infinity, or a rotation that is none."""
    BAD_COVARIANCE = "bad_covariance"
    """The detection's covariance is not symmetric positive definite: nobody knows how sure it is."""
    OUT_OF_ORDER = "out_of_order"
    """The capture is not later than that of the detection before."""
    NO_HEIGHT = "no_height"
    """`bearing` needs the height above the pad, and the pad's altitude is not in the settings."""
    TOO_FLAT = "too_flat"
    """The line of sight is so near the horizon that the height does not tell how far the pad is."""


class FixInput(StrEnum):
    """What a fix was made of."""

    PICTURE_POSE = "picture_pose"
    """The pad's pose by its corners in the picture."""
    LINE_OF_SIGHT = "line_of_sight"
    """Of that pose only the direction to the pad's centre, and the azimuth."""
    HEIGHT = "height"
    """The height above the pad: the vehicle's altitude minus the pad's in the settings."""
    LEVEL_PRIOR = "level_prior"
    """That the pad lies flat: it decided between the two poses that its picture allows, for the one that fits the corners less."""
    POSE_INTERPOLATED = "pose_interpolated"
    """The vehicle's pose between two of its states."""
    POSE_EXTRAPOLATED = "pose_extrapolated"
    """The vehicle's pose beyond its newest state."""
    FIXED_MOUNT = "fixed_mount"
    """The camera's orientation by the settings."""
    GIMBAL = "gimbal"
    """The camera's orientation by the angles that a gimbal reported."""
    PAD_AZIMUTH = "pad_azimuth"
    """The pad's surveyed azimuth, against which its print tells the heading's error."""
    PAD_TILT = "pad_tilt"
    """How level the pad was surveyed to lie, against which its print tells the error of roll and pitch."""
    CORRECTION = "correction"
    """A correction of the installation's systematic error."""


class PadPosition(Part):
    """Where the pad is, relative to the vehicle and on the earth."""

    pad_ned_m: Vector3
    """From the vehicle's body origin to the pad's centre, north, east, down, metres."""
    position: GlobalPosition
    """The pad's centre on the earth."""
    azimuth_rad: Annotated[float, Field(ge=-3.1415926536, le=3.1415926536)]
    """Azimuth of the print's upward direction, from north, clockwise (Eq. 16), rad."""


class SharedErrors(Part):
    """Where one standard deviation of each error that neighbouring fixes have in common puts the pad: it does not average out.

    The errors are independent of each other. Displacements of `pad_ned_m`, north, east, down, metres.
    """

    tilt_north_ned_m: Vector3
    """Attitude, turned about north; the mount, too, where the settings do not tell them apart."""
    tilt_east_ned_m: Vector3
    """The same about east."""
    heading_ned_m: Vector3
    """Heading and mount, turned about down."""
    range_ned_m: Vector3
    """Focal length: along the optical axis."""
    principal_x_ned_m: Vector3
    """Principal point, across the picture."""
    principal_y_ned_m: Vector3
    """Principal point, down the picture."""
    timing_ned_m: Vector3
    """Capture time against the time of the pose: along the pad's apparent motion."""
    size_ned_m: Vector3 = (0.0, 0.0, 0.0)
    """Size of the pad in the picture: along the line of sight. It passes as the pad grows."""
    height_ned_m: Vector3 = (0.0, 0.0, 0.0)
    """Height above the pad by the vehicle's altitude, as far as the fix takes that."""
    mount_roll_ned_m: Vector3 = (0.0, 0.0, 0.0)
    """The camera's mount, turned about the body's forward axis: it lasts longer than what the attitude is wrong by."""
    mount_pitch_ned_m: Vector3 = (0.0, 0.0, 0.0)
    """The same about the body's right axis."""
    heading_rad: Annotated[float, Field(ge=0.0)]
    """The heading's standard deviation itself, which the azimuth shares, rad."""


class PadFix(Traced):
    """One detection brought to the earth, or the reason why it was not."""

    verdict: FixVerdict
    """ACCEPTED, or why there is no fix; the other fields are then absent."""
    detail: ShortText = ""
    """The verdict in words, with numbers."""
    method: ShortText = ""
    """How it was made: `pnp`, `bearing` or `fused`."""
    inputs: Annotated[tuple[FixInput, ...], Field(max_length=16)] = ()
    """What it was made of."""
    raw: PadPosition | None = None
    """By the picture alone, before the systematic error is removed."""
    corrected: PadPosition | None = None
    """After it (Eq. 22-26), and with the height above the pad where the method takes that: what is steered by."""
    covariance_ned_m2: Matrix3 | None = None
    """Covariance of the corrected `pad_ned_m` as a place in the vehicle's navigation solution, m^2."""
    azimuth_variance_rad2: Annotated[float, Field(ge=0.0)] | None = None
    """Variance of the azimuth, rad^2."""
    noise_covariance_ned_m2: Matrix3 | None = None
    """The part of the covariance of the vector itself that is new in each fix: corners, pose between samples. Without the vehicle's
    coordinates, m^2."""
    azimuth_noise_rad2: Annotated[float, Field(ge=0.0)] | None = None
    """The part of the azimuth's variance that is new in each fix, rad^2."""
    shared: SharedErrors | None = None
    """The part that is not: covariance of the vector itself = noise + sum of the outer products of these."""
    vehicle_position: GlobalPosition | None = None
    """Where the vehicle was at capture time."""
    pose_offset_s: float | None = None
    """Capture time minus the newer vehicle sample used; positive exactly when the pose was extrapolated, seconds."""
    latency_s: float | None = None
    """From the light on the sensor to this fix, seconds."""
