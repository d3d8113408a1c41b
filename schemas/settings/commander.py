"""Settings of the commander service: the link to the autopilot, the guidance, and when to let go."""

from typing import Literal

from pydantic import Field

from schemas.message import Vector3
from schemas.settings.section import Section


class LinkSettings(Section):
    """The MAVLink link. The commander has a system id of its own, since it is not part of the vehicle but one who commands it."""

    system_id: int = Field(default=245, ge=1, le=254)
    """Own MAVLink system id. PX4 gives no answer to commands that seem to come from its own autopilot (1/1)."""
    component_id: int = Field(default=191, ge=1, le=254)
    """Own MAVLink component id; 191 is MAV_COMP_ID_ONBOARD_COMPUTER."""
    autopilot_system_id: int = Field(default=0, ge=0, le=254)
    """System id of the autopilot; 0 takes the first whose heartbeat is heard."""
    heartbeat: Literal["auto", "gcs", "onboard_controller"] = "auto"
    """What the own heartbeat says it is. PX4 sends its texts (STATUSTEXT) only where it hears a ground station, but a commander that
    passes for one also hides the loss of the real one from PX4. `auto` passes for a ground station as long as the parameter
    NAV_DLL_ACT is known to be 0, which means that PX4 does nothing on that loss anyway. The newest value counts; it is asked for every ten seconds."""
    timeout_s: float = Field(default=2.0, gt=0.0, le=30.0)
    """Silence of the autopilot longer than this is a lost link."""
    command_tries: int = Field(default=3, ge=1, le=10)
    """How often a command is sent before it counts as unanswered."""
    command_timeout_s: float = Field(default=0.5, gt=0.0, le=10.0)
    """How long an answer is waited for, each time; PX4 takes 22 ms at most."""
    attitude_hz: float = Field(default=100.0, gt=0.0, le=250.0)
    """Rate asked for ATTITUDE_QUATERNION."""
    position_hz: float = Field(default=50.0, gt=0.0, le=250.0)
    """Rate asked for GLOBAL_POSITION_INT; one vehicle state is published for each."""


class GateSettings(Section):
    """Which estimates of the pad may steer."""

    max_sigma_m: float = Field(default=1.0, gt=0.0, le=100.0)
    """Largest horizontal standard deviation (major axis), metres."""
    max_distance_m: float = Field(default=100.0, gt=0.0, le=10000.0)
    """A pad farther from the vehicle than this is not believed, metres."""
    max_jump_m: float = Field(default=1.0, gt=0.0, le=100.0)
    """An estimate that lies farther than this from the last accepted one is held back, metres; farther away a tenth of the height above
    the pad is allowed instead, if that is more."""
    jump_believed_after_s: float = Field(default=1.5, gt=0.0, le=60.0)
    """When the estimates held back agree with each other for this long, the pad is believed to be there, seconds."""
    solution_jump_m: float = Field(default=0.3, gt=0.0, le=100.0)
    """When the vehicle's position changes by so much more than its velocity explains, it is the navigation solution that has jumped (an
    estimator reset): the pad and the setpoint go along with it, metres."""


class CarrySettings(Section):
    """How the last estimate is carried on until the next one comes: see services/commander/carried_pad.py."""

    max_drift_mps: float = Field(default=0.3, ge=0.0, le=20.0)
    """A pad that is said to move faster than this in the navigation solution, or less surely (standard deviation), is not carried: its
    place stays as it was told; horizontal or vertical, m/s. 0 carries nothing. With `filter.method` = `moving`: as fast as the pad may be."""
    for_s: float = Field(default=2.5, ge=0.0, le=30.0)
    """For how long after its capture an estimate is carried, seconds; then its place stands."""
    unknown_drift_mps: float = Field(default=0.05, ge=0.0, le=20.0)
    """How fast a place drifts of which that is not known, standard deviation, m/s: so much less certain it becomes with every second."""


class GlideSettings(Section):
    """Guidance `glide`: OFFBOARD setpoints down a straight line."""

    descent_mps: float = Field(default=1.5, gt=0.0, le=5.0)
    """Vertical speed on the line, m/s."""
    slow_below_m: float = Field(default=3.0, ge=0.0, le=50.0)
    """Height above the pad from which on it goes down slowly, metres."""
    slow_mps: float = Field(default=0.7, gt=0.0, le=2.0)
    """Vertical speed below that height, m/s."""
    touchdown_mps: float = Field(default=0.5, ge=0.3, le=1.0)
    """Vertical speed in the phase TOUCHDOWN, m/s; below 0.3 PX4 does not detect the ground."""
    vertical_below_m: float = Field(default=6.0, ge=0.0, le=50.0)
    """The line ends this high above the pad; from there it goes straight down, metres."""
    switching_height_m: float = Field(default=1.0, gt=0.0, le=10.0)
    """Height above the pad at which DESCEND becomes TOUCHDOWN, metres: nearer than about 0.6 m the marker no longer fits the picture."""
    max_horizontal_mps: float = Field(default=1.5, gt=0.0, le=10.0)
    """Fastest horizontal motion of the setpoint, m/s: the faster, the more the vehicle leans, and a fixed camera with it."""
    line_acceleration_mps2: float = Field(default=0.3, gt=0.0, le=5.0)
    """How fast the horizontal speed may grow on the line, m/s^2."""
    view_edge_deg: float = Field(default=39.0, gt=0.0, le=90.0)
    """Half the camera's narrower field of view. A pad that is seen this far from straight down is flown towards level, and the nearer it is
    to that the slower it goes down: a fixed camera that leans with the vehicle loses what is at the edge of its picture. 90 for a gimbal
    that keeps the pad in view, degrees."""
    acceleration_mps2: float = Field(default=1.0, gt=0.0, le=5.0)
    """How fast the setpoint's velocity may change, m/s^2: what a new estimate changes is flown smoothly."""
    approach_gain_per_s: float = Field(default=1.0, gt=0.0, le=5.0)
    """Near the pad's axis: horizontal speed of the setpoint by its distance to the axis, 1/s."""
    stiffness_per_s: float = Field(default=2.0, ge=0.0, le=5.0)
    """Added to PX4's own gain from a horizontal error to a velocity (MPC_XY_P, 0.95), 1/s."""
    damping: float = Field(default=1.4, ge=0.0, le=3.0)
    """Part of a horizontal error of the velocity that is added to the velocity asked for."""
    trim_gain_per_s: float = Field(default=0.1, ge=0.0, le=2.0)
    """Below the line's end: how fast the setpoint is shifted against the error that the autopilot leaves, 1/s."""
    leash_m: float = Field(default=1.5, gt=0.1, le=10.0)
    """The setpoint waits when it is farther than this from the vehicle, metres."""
    funnel_floor_m: float = Field(default=0.1, gt=0.0, le=10.0)
    """Horizontal error that is always allowed, metres."""
    funnel_slope: float = Field(default=0.1, ge=0.0, le=2.0)
    """Horizontal error allowed besides, by height above the pad, m/m."""
    funnel_patience_s: float = Field(default=30.0, gt=0.0, le=600.0)
    """The landing is given up when the funnel stays closed for this long, seconds."""
    yaw_rate_dps: float = Field(default=30.0, gt=0.0, le=180.0)
    """How fast the heading is turned to the pad's azimuth, degrees/s."""
    setpoint_period_s: float = Field(default=0.05, gt=0.005, le=0.4)
    """A setpoint goes out at least this often, seconds; besides, one for every estimate at once."""


class RepositionSettings(Section):
    """Guidance `reposition`: Algorithm 1 of the paper through DO_REPOSITION."""

    law: Literal["exponential", "linear"] = "exponential"
    """How the altitude of the next setpoint follows from the present one: Eq. 20 or Eq. 17."""
    period_s: float = Field(default=1.0, gt=0.05, le=10.0)
    """Time between setpoints, seconds (the paper: 1 Hz)."""
    beta0: float = Field(default=0.5, ge=0.0, lt=1.0)
    """Shift of the exponential law, in switching heights (Eq. 20)."""
    beta1: float = Field(default=0.1, gt=0.0, lt=1.0)
    """Weight of the exponential (Eq. 20)."""
    alpha_mps: float = Field(default=0.7, gt=0.0, le=3.0)
    """Speed of the linear law, m/s (Eq. 18)."""
    switching_height_m: float = Field(default=2.0, gt=0.0, le=20.0)
    """h0: height above the pad at which the autopilot's own landing mode takes over, metres."""


class CommanderSettings(Section):
    """How the vehicle is brought down, and when it is not."""

    vehicle_url: str = "udpin://127.0.0.1:14540"
    """Where the autopilot is: `udpin://HOST:PORT`, `udpout://HOST:PORT` or `serial:///dev/ttyX?baud=57600`."""
    tick_s: float = Field(default=0.02, ge=0.005, le=0.1)
    """How often the commander looks around when nothing comes in, seconds."""
    guidance: Literal["glide", "reposition"] = "glide"
    """`glide` flies OFFBOARD setpoints straight to the pad; `reposition` is the paper's Algorithm 1."""
    touchdown: Literal["offboard", "land"] = "offboard"
    """How `glide` covers the last metre: by its own setpoints, or by the autopilot's landing mode, which drifts with the wind."""
    align_yaw: bool = True
    """Turn the nose to the pad's azimuth (Eq. 16)."""
    stale_after_s: float = Field(default=2.5, gt=0.1, le=30.0)
    """`glide` holds when the newest estimate is older than this, seconds. From 0.4 of it on it descends ever slower."""
    reposition_stale_after_s: float = Field(default=3.0, gt=0.1, le=30.0)
    """`reposition` holds when the newest estimate is older than this, seconds."""
    state_stale_after_s: float = Field(default=0.5, gt=0.05, le=5.0)
    """Nothing steers on a vehicle state older than this, seconds."""
    acquire_for_s: float = Field(default=0.5, ge=0.0, le=30.0)
    """Good estimates have to come for this long before the descent begins, seconds."""
    acquire_patience_s: float = Field(default=30.0, gt=0.0, le=600.0)
    """The landing is given up when the pad is not found for this long, seconds."""
    hold_patience_s: float = Field(default=30.0, gt=0.0, le=600.0)
    """The landing is given up when a hold for want of estimates lasts this long, seconds."""
    max_holds: int = Field(default=10, ge=0, le=1000)
    """The landing is given up at the next hold for want of estimates after this many."""
    mode_patience_s: float = Field(default=3.0, gt=0.1, le=30.0)
    """How long a mode that was asked for may take to be flown, seconds."""
    descent_patience_s: float = Field(default=300.0, gt=1.0, le=3600.0)
    """The landing is given up when one descent lasts longer than this, seconds."""
    touchdown_patience_s: float = Field(default=20.0, gt=1.0, le=600.0)
    """When TOUCHDOWN by setpoints lasts longer than this, the autopilot's landing mode takes over; after three times that, the commander
    gives up, seconds."""
    takeoff_height_m: float = Field(default=10.0, gt=0.5, le=500.0)
    """Height of a takeoff that names no start point, metres above the point of takeoff."""
    takeoff_patience_s: float = Field(default=60.0, gt=1.0, le=600.0)
    """How long getting ready, arming and climbing may take together, seconds."""
    transit_patience_s: float = Field(default=60.0, gt=1.0, le=600.0)
    """How long the flight to the start point may take, seconds."""
    min_battery: float = Field(default=0.15, ge=0.0, le=1.0)
    """No takeoff and no return out of a failsafe below this remaining charge, 0 to 1; unknown charge is let pass."""
    request_max_age_s: float = Field(default=5.0, gt=0.0, le=60.0)
    """A request older than this is refused, seconds."""
    gimbal: Literal["heard", "ignored"] = "heard"
    """Whatever gimbal reports is taken for the camera's. `ignored` is for a fixed landing camera on a vehicle that carries another camera
    on a gimbal."""
    fixed_gimbal_rpy_deg: Vector3 = (0.0, -90.0, 0.0)
    """How the camera's mount is turned against the body where no gimbal reports: roll, pitch, yaw, degrees; pitch -90 looks down."""
    link: LinkSettings = LinkSettings()
    gate: GateSettings = GateSettings()
    carry: CarrySettings = CarrySettings()
    glide: GlideSettings = GlideSettings()
    reposition: RepositionSettings = RepositionSettings()
