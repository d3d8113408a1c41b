"""Settings of the geolocator service."""

from typing import Annotated, Literal

from pydantic import Field

from schemas.settings.section import Section

SmallAngle = Annotated[float, Field(ge=-45.0, le=45.0)]
LeverArm = Annotated[float, Field(ge=-10.0, le=10.0)]
Standard = Annotated[float, Field(ge=0.0, le=100.0)]
"""A standard deviation."""


class Mount(Section):
    """Where the camera sits, and which way it looks where no gimbal reports its angles.

    The misalignment turns the whole mount (or gimbal) about the body's axes, after its nominal orientation:
    `q_body_gimbal = q(misalignment) * q(nominal or measured)`, both as yaw, pitch, roll (ZYX).
    """

    roll_deg: float = Field(default=0.0, ge=-180.0, le=180.0)
    """Nominal roll of a fixed mount, degrees."""
    pitch_deg: float = Field(default=-90.0, ge=-90.0, le=90.0)
    """Nominal pitch of a fixed mount, degrees; -90 looks straight down (Section 2.4)."""
    yaw_deg: float = Field(default=0.0, ge=-180.0, le=180.0)
    """Nominal yaw of a fixed mount, degrees."""
    misalignment_roll_deg: SmallAngle = 0.0
    """Known installation error about the body's forward axis, degrees."""
    misalignment_pitch_deg: SmallAngle = 0.0
    """Known installation error about the body's right axis, degrees."""
    misalignment_yaw_deg: SmallAngle = 0.0
    """Known installation error about the body's down axis, degrees; positive is clockwise seen from above."""
    forward_m: LeverArm = 0.0
    """Camera in the body frame, forward of its origin, metres."""
    right_m: LeverArm = 0.0
    """Camera in the body frame, to the right, metres."""
    down_m: LeverArm = 0.1
    """Camera in the body frame, below its origin, metres (Section 2.4)."""


class PoseLookup(Section):
    """How the vehicle's pose at capture time is found."""

    pose: Literal["capture", "latest"] = "capture"
    """`capture` looks the pose up at the time of the exposure. `latest` takes the newest one instead: for experiments that show what
    that costs, never for flying."""
    image_latency_s: float = Field(default=0.0, ge=-1.0, le=1.0)
    """How much older than its stamp a picture is, seconds: its pose is looked up so much earlier. `alight calibrate delay` finds it. For
    the sources `device` and `stream` set `camera.live.delay_s` instead, not both: both are subtracted. A correction of the kind
    `extrinsic` brings its own, which counts for the corrected place instead of this one."""
    history_s: float = Field(default=5.0, ge=3.0, le=60.0)
    """How far back poses are kept, seconds."""
    max_extrapolation_s: float = Field(default=0.15, ge=0.0, le=1.0)
    """How far beyond the newest pose a capture may lie, seconds; a later one is refused."""
    max_gap_s: float = Field(default=0.2, gt=0.0, le=5.0)
    """How far apart the two poses around a capture may be, seconds; a wider gap is refused."""
    gimbal_max_age_s: float = Field(default=0.5, gt=0.0, le=10.0)
    """How far from a capture the nearest gimbal angles may be, seconds, once a gimbal has reported any."""


class PadHeight(Section):
    """How high the vehicle is above the pad by its own altitude, which `bearing` needs and `fused` takes beside the picture."""

    pad_altitude_amsl_m: float | None = Field(default=None, ge=-1e3, le=1e4)
    """Altitude of the pad above mean sea level, as the vehicle's navigation solution has it or would have it, metres. None where it is
    not known: `bearing` then refuses, and `fused` does without."""
    sigma_m: float = Field(default=1.0, gt=0.0, le=100.0)
    """Standard deviation of the vehicle's altitude above it, metres: the error of the navigation solution and of the survey. About a metre
    by GNSS and barometer, a few centimetres with RTK."""
    gate_sigma: float = Field(default=3.0, gt=0.0, le=100.0)
    """`fused`: a height that differs from the picture's by more than this many standard deviations of both is left out."""


class SurveyedHeading(Section):
    """Takes the heading from how the pad is turned in the picture instead of from the compass, where the pad's azimuth is known well."""

    pad_azimuth_deg: float | None = Field(default=None, ge=-360.0, le=360.0)
    """Azimuth of the print's upward direction as surveyed, or as `alight calibrate bias` found it, degrees from north, clockwise; left out, the
    compass alone counts. For a pad that stays where it is."""
    sigma_deg: float = Field(default=0.1, ge=0.0, le=45.0)
    """How well it is known, one sigma, degrees."""
    time_s: float = Field(default=60.0, gt=0.0, le=3600.0)
    """How long the compass's error lasts (first-order Gauss-Markov process of the size `uncertainty.yaw_deg`), seconds."""


class SurveyedTilt(Section):
    """Takes roll and pitch from how the pad is tilted in the picture beside the autopilot's, where the pad's own tilt is known well."""

    pad_tilt_deg: tuple[SmallAngle, SmallAngle] | None = None
    """By how much the pad is turned from level about north and about east, degrees: positive has its east edge lower, and its north edge
    higher. `alight calibrate bias` finds it; [0.0, 0.0] for one that was levelled. Left out, the autopilot's attitude alone counts. For a pad
    that stays where it is, and seen from aside: from straight above a print hardly shows a tilt, and little is gained."""
    sigma_deg: float = Field(default=0.05, ge=0.0, le=45.0)
    """How well it is known about each axis, one sigma, degrees."""
    time_s: float = Field(default=5.0, gt=0.0, le=3600.0)
    """How long the error of roll and pitch lasts (first-order Gauss-Markov process), seconds. Its size is `uncertainty.roll_pitch_deg`, with
    that of the mount: say that to the tenth of a degree, or the picture's noise takes the place of the autopilot's."""


class LevelPrior(Section):
    """The pad lies flat: this decides between the two planar solutions where the picture cannot."""

    max_pad_tilt_deg: float = Field(default=15.0, gt=0.0, le=90.0)
    """How far the pad may be from level, degrees. What the picture cannot tell is granted on top; see `services/geolocator/planar.py`."""


class FixUncertainty(Section):
    """Standard deviations behind a fix's covariance, beyond that of the corners."""

    roll_pitch_deg: Standard = 0.5
    """Attitude, about each horizontal axis, degrees; and the mount, unless the next key says that separately."""
    mount_roll_pitch_deg: Standard = 0.0
    """The camera's mount alone, about the body's forward and right axes, degrees: it stays for the whole flight, where an error of the
    attitude passes. 0 where `roll_pitch_deg` counts it in."""
    yaw_deg: Standard = 1.5
    """Heading and mount, about the vertical axis, degrees."""
    time_s: Standard = 0.005
    """Capture time against pose time, seconds; the link's own clock uncertainty is added."""
    position_m: Standard = 0.05
    """Short-term error of the vehicle's position, each axis, metres."""
    focal_fraction: Standard = 0.002
    """Focal length, as a fraction of it: acts on the distance along the optical axis."""
    principal_point_px: Standard = 0.5
    """Principal point, each axis, pixels."""
    pad_size_px: Standard = 0.025
    """Size of the pad in the picture, pixels: what the corners of a small marker have in common (edges that blur into each other move
    outwards) does not average out, and acts on the distance by this part of the pad's size. Measured with the detector `aided` on
    descents of seeds 10000 to 10029, the true focal length taken into account, as 0.02 to 0.03 pixels (root mean square of the flights'
    means) where a marker is 18 to 40 pixels large, and as 0.01 where it is 40 to 65."""
    acceleration_mps2: Standard = 3.0
    """Acceleration that interpolation and extrapolation do not know of, each axis, m/s^2."""
    angular_acceleration_rps2: Standard = 5.0
    """Angular acceleration that they do not know of, each axis, rad/s^2."""


class Extrinsic(Section):
    """What is built otherwise than believed, for `method = "extrinsic"`: the true against the believed.

    The camera is turned by `R_body_camera_true = R_z(yaw) R_y(pitch) R_x(roll) R_body_camera_believed`. The height of the pad is no part of
    it: a pad that lies lower than it was surveyed is truly there.
    """

    mount_roll_deg: SmallAngle = 0.0
    """Turn of the camera about the body's forward axis, degrees."""
    mount_pitch_deg: SmallAngle = 0.0
    """Turn about the body's right axis, degrees."""
    mount_yaw_deg: SmallAngle = 0.0
    """Turn about the body's down axis, degrees; positive is clockwise seen from above."""
    forward_m: LeverArm = 0.0
    """How much farther forward the camera sits than `mount` says, metres."""
    right_m: LeverArm = 0.0
    """How much farther to the right, metres."""
    down_m: LeverArm = 0.0
    """How much lower, metres."""
    focal_scale: float = Field(default=1.0, ge=0.5, le=2.0)
    """True focal length divided by the calibrated one. To first order: from 2 % on calibrate the camera anew."""
    pad_scale: float = Field(default=1.0, ge=0.5, le=2.0)
    """True side of the print divided by the one in the section `pad`."""
    image_latency_s: float = Field(default=0.0, ge=-1.0, le=1.0)
    """A frame's stamp minus the time at which the light hit the sensor, seconds."""


class Correction(Section):
    """The systematic error of the installation: of the vehicle-to-pad vector in cylindrical coordinates (Eq. 22-26), or by its causes.

    Every bias is measured minus true, and is subtracted. Angles are azimuths from north, clockwise. The paper measures its angle from
    east, so its published angle has the opposite sign here.
    """

    method: Literal["none", "cylindrical", "extrinsic"] = "none"
    """Whether to correct, and how: `cylindrical` subtracts the biases below (the paper), `extrinsic` undoes what causes them."""
    theta_deg: float = Field(default=0.0, ge=-180.0, le=180.0)
    """Bias of the azimuth from vehicle to pad, degrees."""
    alpha_r: float = Field(default=0.0, gt=-1.0, lt=1.0)
    """Bias of the horizontal distance per metre of it, dimensionless."""
    beta_r_m: float = Field(default=0.0, ge=-10.0, le=10.0)
    """Constant bias of the horizontal distance, metres."""
    beta_d_m: float = Field(default=0.0, ge=-10.0, le=10.0)
    """Bias of the vehicle's height above the pad, metres."""
    turn_azimuth: bool = True
    """Subtract the angle from the pad's azimuth, too: true if the angle comes from the camera's mount, which turns both."""
    extrinsic: Extrinsic = Extrinsic()


PAPER_MEAN_CORRECTION = Correction(
    method="cylindrical", theta_deg=4.007078, alpha_r=2.4923e-2, beta_r_m=2.778497e-2, beta_d_m=0.488412
)
"""The paper's camera (Table 3, row "Mean"; Fig. 12), at 10 m above the pad."""

PAPER_MEDIAN_CORRECTION = Correction(
    method="cylindrical", theta_deg=4.056872, alpha_r=2.4923e-2, beta_r_m=2.778497e-2, beta_d_m=0.545400
)
"""The same by medians (Table 3, row "Median"; Fig. 12)."""


class GeolocatorSettings(Section):
    """How a detection becomes a place on the earth."""

    method: Literal["pnp", "bearing", "fused"] = "fused"
    """`pnp` takes the pad's pose by its corners (the paper). `bearing` takes of it the line of sight to the pad's centre, and the distance
    from the height above the pad. `fused` takes both, weighted by their covariances."""
    height: PadHeight = PadHeight()
    mount: Mount = Mount()
    lookup: PoseLookup = PoseLookup()
    level: LevelPrior = LevelPrior()
    uncertainty: FixUncertainty = FixUncertainty()
    heading: SurveyedHeading = SurveyedHeading()
    tilt: SurveyedTilt = SurveyedTilt()
    correction_file: str = ""
    """TOML file that `alight calibrate bias` has written; empty for the section below."""
    correction: Correction = Correction()
    """The correction, where no file is named."""
