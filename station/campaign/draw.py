"""From the campaign's seed to the settings of flight i: the same whoever flies it, and in whatever order."""

import tomllib
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from alight.runtime.settings_file import SettingsError, settings_from
from schemas.settings import Settings
from schemas.settings.simulator import Airborne
from station.campaign.factor import Listed
from station.campaign.flight_task import FlightTask
from station.campaign.polar import without_polar
from station.campaign.spec import CampaignSpec, SpecError
from station.flight_settings import PRESETS

SEED = "seed"


def drawn_values(spec: CampaignSpec, index: int) -> dict[str, Any]:
    """What flight `index` has of each factor, by key.

    Neighbouring flights have different combinations, so that a part of a campaign covers all of them, and more flights
    leave the first ones as they were. Each factor has a random stream of its own, so that adding one leaves the others as
    they were.
    """
    combination, repetition = index % spec.combinations, index // spec.combinations
    number = repetition if spec.paired else index
    values: dict[str, Any] = {}
    if SEED not in spec.factors and SEED not in spec.settings:
        values[SEED] = int(_stream(spec, number, SEED).integers(2**31))
    for key, factor in reversed(spec.factors.items()):
        if isinstance(factor, Listed):
            combination, place = divmod(combination, len(factor.values))
            values[key] = factor.values[place]
        else:
            values[key] = factor.draw(_stream(spec, number, key))
    return {key: values[key] for key in (SEED, *spec.factors) if key in values}


class FlightTasks(Mapping[int, FlightTask]):
    """The flights of a campaign by index, each made when it is asked for."""

    def __init__(self, spec: CampaignSpec, path: Path) -> None:
        """Draw and check all of them.

        Args:
            spec: The campaign.
            path: Its file, for the message of an error.

        Raises:
            SpecError: Naming file, key, the flight that drew the value, and the remedy.
        """
        self._spec, self._path = spec, path
        preset = tomllib.loads((PRESETS / f"{spec.preset}.toml").read_text(encoding="utf-8")) if spec.preset else {}
        self._below = [(f"preset {spec.preset}", preset), (f"{path}: [settings]", spec.settings)]
        _valid(self._below)
        for index in range(spec.total):
            self._settings(index, drawn_values(spec, index))

    def __getitem__(self, index: int) -> FlightTask:
        if not 0 <= index < self._spec.total:
            raise KeyError(index)
        drawn = drawn_values(self._spec, index)
        return _task(self._spec, index, drawn, self._settings(index, drawn))

    def __iter__(self) -> Iterator[int]:
        return iter(range(self._spec.total))

    def __len__(self) -> int:
        return self._spec.total

    def _settings(self, index: int, drawn: Mapping[str, Any]) -> Settings:
        try:
            table = _nested(without_polar(drawn))
        except ValueError as error:
            raise SpecError(f"{self._path}: factors.{error}") from None
        return _valid([*self._below, (f"{self._path}: [factors], flight {index}", table)])


def _task(spec: CampaignSpec, index: int, drawn: Mapping[str, Any], settings: Settings) -> FlightTask:
    start, pad = settings.simulator.airborne or Airborne(), settings.simulator.pad
    airborne = start if spec.begin == "air" else None
    simulator = settings.simulator.model_copy(update={"airborne": airborne})
    return FlightTask(
        index=index,
        drawn=dict(drawn),
        settings=settings.model_copy(update={"simulator": simulator}),
        start_ned_m=(pad.north_m + start.north_m, pad.east_m + start.east_m, start.down_m - pad.height_above_home_m),
        flight_timeout_s=spec.flight_timeout_s,
        pad_radius_m=spec.pad_radius_m,
    )


def _valid(layers: list[tuple[str, dict[str, Any]]]) -> Settings:
    try:
        return settings_from(layers)
    except SettingsError as error:
        raise SpecError(str(error)) from None


def _stream(spec: CampaignSpec, number: int, key: str) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(spec.seed, spawn_key=(number, zlib.crc32(key.encode()))))


def _nested(values: Mapping[str, Any]) -> dict[str, Any]:
    table: dict[str, Any] = {}
    for key, value in values.items():
        *sections, last = key.split(".")
        section = table
        for name in sections:
            section = section.setdefault(name, {})
        section[last] = value
    return table
