"""Settings of the filter service."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from schemas.settings.section import Section

Standard = Annotated[float, Field(ge=0.0, le=100.0)]
"""A standard deviation."""

Method = Literal["none", "mean", "median", "kalman", "moving"]
"""How fixes become an estimate."""

Duration = Annotated[float, Field(gt=0.0, le=1e5)]
"""A correlation time, seconds."""


class OutlierGate(Section):
    """Keeps fixes out that cannot be the pad."""

    sigma: float = Field(default=5.0, ge=0.0, le=100.0)
    """A fix further than this many standard deviations from the estimate is left out; 0 lets all in."""
    memory: int = Field(default=20, ge=3, le=1000)
    """Windows: if most of this many last fixes were left out, the estimate is the one that is wrong: it is dropped."""


class Kalman(Section):
    """What `kalman` and `moving` take for granted: how the navigation solution wanders, and which errors last."""

    confirm_fixes: int = Field(default=3, ge=1, le=100)
    """So many fixes have to agree before the first estimate leaves."""
    recover_fixes: int = Field(default=10, ge=2, le=1000)
    """So many refused fixes in a row that agree with each other take the estimate's place."""
    position_noise_m: Standard = 0.01
    """Quick error of the vehicle's position, new in each fix, each axis, metres, at most: the solution's noise and its last digit on the link.
    How much less it is, the filter learns from the fixes."""
    wander_m: Standard = 0.01
    """How far the navigation solution walks at random within a second, each axis, metres."""
    restless_m: Standard = 0.3
    """How far it may walk within a second at most where the fixes show that it walks farther than that, each axis, metres: then so much is
    learnt from them. 0 learns nothing, and refuses them."""
    drift_mps: Standard = 0.03
    """How fast the navigation solution drifts, each axis, m/s; 0.03 is about a metre a minute."""
    drift_time_s: Duration = 30.0
    """For how long a drift goes on, seconds."""
    attitude_time_s: Duration = 10.0
    """For how long an error of roll and pitch lasts, seconds; that of the mount, too, where fixes do not tell them apart."""
    mount_time_s: Duration = 3600.0
    """For how long an error of the camera's mount lasts, seconds, where fixes tell it apart from that of the attitude."""
    heading_time_s: Duration = 60.0
    """For how long an error of the heading lasts, seconds."""
    lens_time_s: Duration = 600.0
    """For how long an error of the camera's calibration lasts, seconds."""
    timing_time_s: Duration = 60.0
    """For how long an error of the capture time lasts, seconds."""
    size_time_s: Duration = 10.0
    """For how long an error of the pad's size in the picture lasts, seconds."""
    height_time_s: Duration = 30.0
    """For how long an error of the height above the pad lasts (the navigation solution's, where the geolocator takes that), seconds."""
    azimuth_wander_deg: Standard = 0.2
    """How far the heading walks at random within a second, degrees."""
    pad_mps: Standard = 1.5
    """`moving` only: how fast the pad may move, each horizontal axis, m/s."""
    pad_time_s: Duration = 10.0
    """`moving` only: for how long it keeps a velocity, seconds."""
    jump_m: float = Field(default=0.3, gt=0.0, le=100.0)
    """When the vehicle's position changes by this much more than its velocity explains between two states, the navigation solution has
    jumped (an estimator reset), and the pad's coordinates with it, metres."""
    jump_sigma_m: Standard = 0.1
    """How well the size of such a jump is then known, each axis, metres."""
    give_up_sigma_m: float = Field(default=5.0, gt=0.0, le=1000.0)
    """A track that has coasted until its horizontal standard deviation exceeds this begins anew, metres."""


class FilterMethod(Section):
    """How fixes become an estimate: a Kalman filter, or the paper's window (Section 3.1.3)."""

    method: Method = "kalman"
    """`none` passes each fix on. `mean` and `median` average a window of fixes, each window beginning with the last one's result.
    `kalman` follows the pad's coordinates in the drifting navigation solution; `moving` does so for a pad that travels."""
    window_length: int = Field(default=5, ge=2, le=1000)
    """L: how many entries the window holds, the last result being the first of them."""
    rate_hz: float = Field(default=0.0, ge=0.0, le=1000.0)
    """Windows and `none`: estimates are released at most this often, Hz; 0 releases whenever the window is full. The paper: 1."""
    min_entries: int | None = Field(default=None, ge=2, le=1000)
    """With a rate: release when it is time and the window holds this many entries; by default when it is full. The paper: 10."""
    reset_after_s: float = Field(default=2.0, gt=0.0, le=3600.0)
    """The window is thrown away if no fix entered it for this long, seconds. (`kalman` coasts.)"""
    systematic_angle_deg: float = Field(default=0.5, ge=0.0, le=45.0)
    """Error of direction (attitude, mount) that is the same in all fixes of a window and does not average out, degrees. `kalman` takes
    it, and the two below, only where a fix does not say which of its errors are shared."""
    systematic_azimuth_deg: float = Field(default=1.0, ge=0.0, le=180.0)
    """The same for the azimuth (heading), degrees."""
    systematic_position_m: float = Field(default=0.02, ge=0.0, le=100.0)
    """The same for the position on each axis, metres."""
    gate: OutlierGate = OutlierGate()
    kalman: Kalman = Kalman()

    @model_validator(mode="after")
    def _window_can_hold_them(self) -> Self:
        if self.min_entries is not None and self.min_entries > self.window_length:
            raise ValueError(f"min_entries {self.min_entries} exceeds window_length {self.window_length}")
        return self


class ShadowFilter(FilterMethod):
    """A filter that runs beside the active one on the same fixes: recorded and scored, without authority."""

    name: str = Field(pattern=r"^[a-z0-9][a-z0-9_-]{0,31}$")
    """Under which its estimates are recorded."""


class FilterSettings(FilterMethod):
    """How fixes become an estimate: a Kalman filter, or the paper's window (Section 3.1.3); and which filters run beside it."""

    shadows: tuple[ShadowFilter, ...] = Field(default=(), max_length=16)
    """Filters to run beside the active one: `[{name = "paper", method = "mean"}]`, each with any of the keys of this section."""

    @model_validator(mode="after")
    def _names_are_unique(self) -> Self:
        names = ["active", *(shadow.name for shadow in self.shadows)]
        if len(set(names)) < len(names):
            raise ValueError(f"shadows need names of their own, other than 'active': {', '.join(names[1:])}")
        return self
