"""Settings of the filter service."""

from typing import Literal, Self

from pydantic import Field, model_validator

from schemas.settings.section import Section


class OutlierGate(Section):
    """Keeps fixes out that cannot be the pad."""

    sigma: float = Field(default=5.0, ge=0.0, le=100.0)
    """A fix further than this many standard deviations from the estimate is left out; 0 lets all in."""
    memory: int = Field(default=20, ge=3, le=1000)
    """If most of this many last fixes were left out, the estimate is the one that is wrong: it is dropped."""


class FilterSettings(Section):
    """How fixes become an estimate (Section 3.1.3)."""

    method: Literal["none", "mean", "median"] = "mean"
    """`none` passes each fix on. `mean` and `median` average a window of fixes, each window beginning with the last one's result."""
    window_length: int = Field(default=5, ge=2, le=1000)
    """L: how many entries the window holds, the last result being the first of them."""
    rate_hz: float = Field(default=0.0, ge=0.0, le=1000.0)
    """Estimates are released at most this often, Hz; 0 releases whenever the window is full. The paper: 1."""
    min_entries: int | None = Field(default=None, ge=2, le=1000)
    """With a rate: release when it is time and the window holds this many entries; by default when it is full. The paper: 10."""
    reset_after_s: float = Field(default=2.0, gt=0.0, le=3600.0)
    """The window is thrown away if no fix entered it for this long, seconds."""
    systematic_angle_deg: float = Field(default=0.5, ge=0.0, le=45.0)
    """Error of direction (attitude, mount) that is the same in all fixes of a window and does not average out, degrees."""
    systematic_azimuth_deg: float = Field(default=1.0, ge=0.0, le=180.0)
    """The same for the azimuth (heading), degrees."""
    systematic_position_m: float = Field(default=0.02, ge=0.0, le=100.0)
    """The same for the position on each axis, metres."""
    gate: OutlierGate = OutlierGate()

    @model_validator(mode="after")
    def _window_can_hold_them(self) -> Self:
        if self.min_entries is not None and self.min_entries > self.window_length:
            raise ValueError(f"min_entries {self.min_entries} exceeds window_length {self.window_length}")
        return self
