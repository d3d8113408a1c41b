"""Settings of the simulator service: the world, its vehicle, and every error that is put into them."""

from typing import Annotated, Literal

from pydantic import Field

from schemas.settings.section import Section

Standard = Annotated[float, Field(ge=0.0, le=1e3)]
"""A standard deviation; 0 switches the error off."""

Duration = Annotated[float, Field(gt=0.0, le=1e5)]
"""A correlation time, seconds."""


class Home(Section):
    """Where the vehicle stands when it is switched on."""

    latitude_deg: float = Field(default=47.397742, ge=-89.0, le=89.0)
    """Geodetic latitude, WGS84, degrees."""
    longitude_deg: float = Field(default=8.545594, ge=-180.0, le=180.0)
    """Longitude, WGS84, degrees."""
    altitude_amsl_m: float = Field(default=489.4, ge=-400.0, le=6000.0)
    """Altitude of the ground above mean sea level, metres."""
    geoid_separation_m: float = Field(default=0.0, ge=-120.0, le=120.0)
    """Height of the geoid above the ellipsoid: ellipsoidal height = AMSL + this, metres."""
    azimuth_deg: float = Field(default=0.0, ge=-360.0, le=360.0)
    """Where the nose points at the start, degrees from north, clockwise."""


class PadPlace(Section):
    """Where the pad truly lies. What is printed on it stands in the section `pad` of the whole file."""

    north_m: float = Field(default=5.0, ge=-5000.0, le=5000.0)
    """North of home, metres."""
    east_m: float = Field(default=3.0, ge=-5000.0, le=5000.0)
    """East of home, metres."""
    height_above_home_m: float = Field(default=0.0, ge=-50.0, le=50.0)
    """Height of the pad, and of the ground within 2 m of it, above the ground at home, metres."""
    azimuth_deg: float = Field(default=0.0, ge=-360.0, le=360.0)
    """Azimuth of the print's upward direction, degrees from north, clockwise."""


class Wind(Section):
    """Air that moves: a steady part, and gusts as a first-order Gauss-Markov process."""

    north_mps: float = Field(default=0.0, ge=-20.0, le=20.0)
    """Steady wind towards north, m/s."""
    east_mps: float = Field(default=0.0, ge=-20.0, le=20.0)
    """Steady wind towards east, m/s."""
    gust_mps: float = Field(default=0.0, ge=0.0, le=10.0)
    """Standard deviation of the gusts along north and along east, m/s; half of it vertically."""
    gust_time_s: Duration = 2.0
    """Correlation time of the gusts, seconds."""


class SensorErrors(Section):
    """How far the navigation solution is from the truth. The autopilot flies on the solution.

    The defaults have the size that PX4's simulation in hardware (SIH) shows in flight: position 0.02 m, velocity 0.02 m/s, yaw 0.3-0.7
    degrees with a bias of up to 1 degree. `HARSH_SENSOR_ERRORS` is what a plain GNSS receiver, barometer and magnetometer give outdoors.
    """

    position_wander_m: Standard = 0.02
    """Slow error of the position along north and along east, standard deviation, metres."""
    position_wander_time_s: Duration = 30.0
    """Its correlation time, seconds."""
    wander_smoothing_s: float = Field(default=0.0, ge=0.0, le=1e3)
    """The wander of position and altitude passes a low-pass of this time constant, seconds: a navigation filter follows its receiver
    slowly, so that its error drifts and does not jitter. 0 for none: the error is then as rough as a random walk."""
    position_noise_m: Standard = 0.004
    """Quick error of the position on each axis (correlation time 0.1 s), standard deviation, metres."""
    altitude_wander_m: Standard = 0.02
    """Slow error of the altitude (barometer drift), standard deviation, metres."""
    altitude_wander_time_s: Duration = 60.0
    """Its correlation time, seconds."""
    velocity_noise_mps: Standard = 0.02
    """Error of the velocity on each axis (correlation time 0.5 s), standard deviation, m/s."""
    tilt_noise_deg: Standard = 0.1
    """Error of roll and of pitch (correlation time 5 s), standard deviation, degrees."""
    yaw_bias_deg: Standard = 0.5
    """Constant error of the heading, drawn once from this standard deviation, degrees."""
    yaw_noise_deg: Standard = 0.3
    """Slow error of the heading (correlation time 10 s), standard deviation, degrees."""
    rate_noise_dps: Standard = 0.2
    """Noise of the gyros on each axis, each sample anew, standard deviation, degrees/s."""
    gnss_noise_m: Standard = 0.3
    """Error of GPS_RAW_INT beyond the solution's own (correlation time 10 s), standard deviation, metres."""


HARSH_SENSOR_ERRORS = SensorErrors(
    position_wander_m=0.6,
    position_wander_time_s=60.0,
    position_noise_m=0.02,
    altitude_wander_m=0.5,
    altitude_wander_time_s=120.0,
    velocity_noise_mps=0.06,
    tilt_noise_deg=0.4,
    yaw_bias_deg=2.0,
    yaw_noise_deg=0.7,
    rate_noise_dps=0.5,
    gnss_noise_m=1.0,
)
"""A plain receiver without corrections, a drifting barometer, a magnetometer beside iron."""


class Installation(Section):
    """What is built otherwise than the geolocator believes. The camera's renderer applies it; the vehicle does not.

    The true camera is turned against the believed one by `R_z(yaw) R_y(pitch) R_x(roll)` in the body frame (forward, right, down):
    `R_body_camera_true = R_z R_y R_x R_body_camera_believed`.
    """

    mount_yaw_deg: float = Field(default=0.0, ge=-45.0, le=45.0)
    """Turn about the body's down axis, degrees; positive is clockwise seen from above."""
    mount_pitch_deg: float = Field(default=0.0, ge=-45.0, le=45.0)
    """Turn about the body's right axis, degrees."""
    mount_roll_deg: float = Field(default=0.0, ge=-45.0, le=45.0)
    """Turn about the body's forward axis, degrees."""
    lens_scale: float = Field(default=1.0, ge=0.5, le=2.0)
    """True focal length divided by the calibrated one."""
    pad_scale: float = Field(default=1.0, ge=0.5, le=2.0)
    """True side of the print divided by the one in the section `pad`."""
    image_latency_s: float = Field(default=0.0, ge=0.0, le=1.0)
    """How much older the picture is than its stamp says: stamp minus the time the light truly hit the sensor, seconds."""


class Vehicle(Section):
    """The quadrotor: 1 kg, four rotors of 5 N in an X of 0.4 m, as in PX4's simulation in hardware."""

    drag_n_per_mps: float = Field(default=0.3, ge=0.0, le=5.0)
    """Linear drag, newtons for each m/s of air speed; a real vehicle of this size has 0.2 to 0.4. 1.0 is PX4's simulation, which leans 17
    degrees into 3 m/s."""
    gear_height_m: float = Field(default=0.2, ge=0.0, le=2.0)
    """Height of the body's origin above the ground when it stands, metres."""


class Airborne(Section):
    """Begin in the air, armed and holding, as if flown there before."""

    north_m: float = Field(default=10.0, ge=-1000.0, le=1000.0)
    """North of the pad, metres."""
    east_m: float = Field(default=10.0, ge=-1000.0, le=1000.0)
    """East of the pad, metres."""
    down_m: float = Field(default=-20.0, ge=-1000.0, le=-0.5)
    """Below the pad, metres; negative is above."""


class SimulatorSettings(Section):
    """The vehicle and the world, where there is no real one."""

    kind: Literal["embedded", "mavlink_truth"] = "embedded"
    """`embedded` simulates vehicle and autopilot. `mavlink_truth` reads the ground truth of a PX4 simulation (SIH) that runs elsewhere."""
    home: Home = Home()
    pad: PadPlace = PadPlace()
    wind: Wind = Wind()
    vehicle: Vehicle = Vehicle()
    sensors: SensorErrors = SensorErrors()
    installation: Installation = Installation()
    airborne: Airborne | None = None
    """Where to begin in the air; none begins on the ground at home."""
    lead_s: float = Field(default=0.03, ge=0.0, le=0.2)
    """How far ahead of the clock the vehicle is computed, so that the renderer has the truth in time, seconds. A little less than
    the period of the frames is best: a drawing then begins when the frame before has just left, and keeps none waiting."""
    truth_hz: float = Field(default=60.0, gt=0.0, le=250.0)
    """How often the ground truth is published."""
    system_id: int = Field(default=1, ge=1, le=250)
    """MAVLink system id of the autopilot; its component id is 1."""
    parameters: dict[Annotated[str, Field(pattern=r"^[A-Z0-9_]{1,16}$")], float] = Field(default_factory=dict)
    """PX4 parameters to change, such as `COM_OBL_RC_ACT = 5`. A name that the autopilot does not have is refused at the start."""
    url: str = "udp://127.0.0.1:14580?to=127.0.0.1:14540"
    """Onboard link of the embedded autopilot: where it listens and where it sends to."""
    gcs_url: str = ""
    """Second link, for a ground control station, such as `udp://127.0.0.1:18570?to=127.0.0.1:14550`; empty for none."""
    truth_url: str = "udpin://127.0.0.1:14550"
    """For `mavlink_truth`: the link on which the PX4 simulation is heard."""
