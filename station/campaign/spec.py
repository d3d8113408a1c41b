"""What a campaign flies: the TOML file that `alight campaign` takes."""

import difflib
import hashlib
import json
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError

from schemas.settings import Section
from station.campaign.factor import Factor, Listed, factor_from
from station.flight_settings import PRESETS, preset_names

_NOT_FLOWN = frozenset({"flights", "time_limit_s", "keep"})
"""What changes no flight: a campaign may go on with more flights, more patience, more recordings."""


class SpecError(ValueError):
    """A campaign that cannot be flown as it is written: one line with file, key, reason and remedy."""


class Keep(Section):
    """Of which flights a recording is made (by flying them once more), in DIR/flights."""

    worst: int = Field(default=5, ge=0, le=1000)
    """How many of the landed flights, those with the largest error at touchdown."""
    failed: int = Field(default=10, ge=0, le=1000)
    """How many of those that did not land on the pad, the first ones."""


class CampaignSpec(Section):
    """One campaign."""

    name: str = Field(pattern=r"^[A-Za-z0-9_.-]{1,64}$")
    """Its name."""
    seed: int = Field(default=0, ge=0, lt=2**63)
    """Everything that is drawn follows from it; so do the flights' own seeds."""
    flights: int = Field(default=1, ge=1, le=1_000_000)
    """Flights for each combination of the listed values; without lists, for all. More of them later go on with the campaign."""
    paired: bool = True
    """Fly each combination with the same draws and seeds, so that differences come from the listed values alone."""
    preset: str = ""
    """Settings that come with Alight, below all others."""
    begin: Literal["air", "ground"] = "air"
    """`air` begins at the start, holding; `ground` takes off at home and flies there first."""
    flight_timeout_s: float = Field(default=120.0, gt=0.0, le=3600.0)
    """A flight is given up after so many seconds of its own (virtual) time."""
    time_limit_s: float = Field(default=300.0, gt=0.0, le=86400.0)
    """A flight that a machine has worked on for so many seconds hangs, and is ended."""
    pad_radius_m: float = Field(default=0.5, gt=0.0, le=100.0)
    """How far from the pad's centre still counts as on the pad, metres."""
    keep: Keep = Keep()
    settings: dict[str, Any] = Field(default_factory=dict)
    """What is set in all flights, as in a settings file."""
    factors: dict[str, Factor] = Field(default_factory=dict)
    """What varies, by key of the settings, and the keys `wind.*` and `start.*` of `station/campaign/polar.py`."""

    @property
    def listed(self) -> dict[str, Listed]:
        """The factors whose combinations are flown."""
        return {key: factor for key, factor in self.factors.items() if isinstance(factor, Listed)}

    @property
    def combinations(self) -> int:
        """How many combinations of listed values there are."""
        count = 1
        for factor in self.listed.values():
            count *= len(factor.values)
        return count

    @property
    def total(self) -> int:
        """How many flights there are."""
        return self.combinations * self.flights

    @property
    def digest(self) -> str:
        """SHA-256 over everything that decides how flight i goes, 64 hexadecimal digits."""
        said = self.model_dump(mode="json", exclude=set(_NOT_FLOWN))
        said["factors"] = list(said["factors"].items())  # the order of the lists decides which combination flight i has
        preset = PRESETS / f"{self.preset}.toml"
        said["preset"] = preset.read_text(encoding="utf-8") if self.preset else ""
        return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()


def read_spec(path: Path, flights: int | None = None) -> CampaignSpec:
    """Read a campaign's file.

    Args:
        path: The TOML file.
        flights: Instead of the number in the file.

    Raises:
        SpecError: Naming file, key and remedy. The flights' settings are not looked at here; see `station/campaign/draw.py`.
    """
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SpecError(f"{path}: cannot be read ({error.strerror}): check the path") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SpecError(f"{path}: not valid TOML: {error}") from None
    table.setdefault("name", path.stem)
    if flights is not None:
        table["flights"] = flights
    given = table.get("factors", {})
    if not isinstance(given, Mapping):
        raise SpecError(
            f"{path}: factors: a table is needed, such as [factors] with camera.rate_hz = [10, 30] below it"
        )
    table["factors"] = dict(_factors(given, "", path))
    try:
        spec = CampaignSpec.model_validate(table)
    except ValidationError as error:
        raise SpecError(f"{path}: {_explain(error)}") from None
    if spec.preset and spec.preset not in preset_names():
        raise SpecError(f"{path}: preset: there is no `{spec.preset}`; there are {', '.join(preset_names())}")
    return spec


def _factors(table: Mapping[str, Any], prefix: str, path: Path) -> Iterator[tuple[str, Factor]]:
    for name, value in table.items():
        key = f"{prefix}{name}"
        try:
            factor = factor_from(value)
        except ValidationError as error:
            raise SpecError(f"{path}: factors.{key}: {_explain(error)}") from None
        except ValueError as error:
            raise SpecError(f"{path}: factors.{key}: {error}") from None
        if factor is None:
            yield from _factors(value, f"{key}.", path)
        else:
            yield key, factor


def _explain(error: ValidationError) -> str:
    first = error.errors(include_url=False)[0]
    dotted = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        near = difflib.get_close_matches(str(first["loc"][-1]), _KEYS, n=1)
        remedy = f"did you mean {near[0]}?" if near else "settings of the services go below [settings]"
        return f"{dotted} is no key here; {remedy}"
    message = first["msg"].removeprefix("Value error, ")
    return f"{dotted}: {message}" if dotted else message


_KEYS = [*CampaignSpec.model_fields, *Keep.model_fields, "uniform", "normal", "choice", "within", "integer", "weights"]
