"""What varies in a campaign: a list of values, or a distribution to draw from."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import Field, model_validator

from schemas.settings import Section

Interval = tuple[float, float]
_LEAST_SHARE = 0.001
"""`within` must hold at least this share of a normal distribution: what lies outside is drawn again."""


class Listed(Section):
    """Each value in turn: with other lists, every combination is flown."""

    values: tuple[Any, ...] = Field(min_length=1)
    """The values, such as `[1.0, 2.0]` or `["glide", "reposition"]`."""


class Uniform(Section):
    """Anything between two numbers, all equally likely."""

    uniform: Interval
    """The least and the greatest value."""
    integer: bool = False
    """Whole numbers only, both ends included."""

    @model_validator(mode="after")
    def _ordered(self) -> "Uniform":
        low, high = self.uniform
        if not low < high:
            raise ValueError(f"uniform = [{low:g}, {high:g}] holds nothing: write the smaller number first")
        if self.integer and (low % 1.0 or high % 1.0):
            raise ValueError("with integer = true both ends must be whole numbers")
        return self

    def draw(self, random: np.random.Generator) -> float | int:
        """One value."""
        low, high = self.uniform
        return int(random.integers(int(low), int(high) + 1)) if self.integer else float(random.uniform(low, high))


class Normal(Section):
    """A bell curve, cut off where that is asked for."""

    normal: Interval
    """Mean and standard deviation."""
    within: Interval | None = None
    """What falls outside these two numbers is drawn again."""

    @model_validator(mode="after")
    def _possible(self) -> "Normal":
        sigma = self.normal[1]
        if sigma < 0.0:
            raise ValueError(f"the standard deviation {sigma:g} is negative")
        if self.within is not None and self._share(*self.within) < _LEAST_SHARE:
            low, high = self.within
            raise ValueError(f"within = [{low:g}, {high:g}] holds less than 0.1 % of this distribution: widen it")
        return self

    def draw(self, random: np.random.Generator) -> float:
        """One value."""
        low, high = self.within or (-math.inf, math.inf)
        while True:
            value = float(random.normal(*self.normal))
            if low <= value <= high:
                return value

    def _share(self, low: float, high: float) -> float:
        mean, sigma = self.normal
        if sigma == 0.0:
            return float(low <= mean <= high)
        return 0.5 * (
            math.erf((high - mean) / (sigma * math.sqrt(2.0))) - math.erf((low - mean) / (sigma * math.sqrt(2.0)))
        )


class Choice(Section):
    """One of several values by chance."""

    choice: tuple[Any, ...] = Field(min_length=1)
    """The values."""
    weights: tuple[float, ...] = ()
    """How likely each is, in any scale; empty for all alike."""

    @model_validator(mode="after")
    def _weighed(self) -> "Choice":
        if self.weights and (
            len(self.weights) != len(self.choice) or min(self.weights) < 0.0 or sum(self.weights) <= 0.0
        ):
            raise ValueError(f"weights must be {len(self.choice)} numbers, none negative and not all zero")
        return self

    def draw(self, random: np.random.Generator) -> Any:
        """One value."""
        weights = np.array(self.weights or (1.0,) * len(self.choice))
        return self.choice[int(random.choice(len(self.choice), p=weights / weights.sum()))]


Factor = Listed | Uniform | Normal | Choice
_KINDS: dict[str, type[Uniform | Normal | Choice]] = {"uniform": Uniform, "normal": Normal, "choice": Choice}


def factor_from(value: Any) -> Factor | None:
    """A factor as it stands in the file; None for a table that is none, but a section with factors in it.

    Raises:
        ValidationError: If its numbers make no sense.
        ValueError: If it is a constant.
    """
    if isinstance(value, list):
        return Listed(values=tuple(value))
    if not isinstance(value, Mapping):
        raise ValueError(
            f"{value!r} is neither a list nor a distribution: a constant belongs in [settings]; "
            "write [1, 2], {uniform = [0, 1]}, {normal = [0, 1]} or {choice = [1, 2]}"
        )
    kind = next((kind for key, kind in _KINDS.items() if key in value), None)
    return None if kind is None else kind.model_validate(value)
