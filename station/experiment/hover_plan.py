"""Where the vehicle hovers for the error model, and what the installation is like (Section 4.2)."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from alight.runtime.settings_file import SettingsError, load_settings
from schemas.settings import Settings
from station.flight_settings import PRESETS

PRESET = PRESETS / "paper-uncorrected.toml"
"""The errors of the installation; no correction."""
DIAGONALS_DEG = (45.0, 135.0, 225.0, 315.0)
DISTANCES_M = tuple(step * math.sqrt(2.0) for step in (2.0, 3.0, 4.0, 5.0))
ABOVE_THE_PAD = 4
"""Records of the position above the pad's centre: 16 + 4 are the paper's twenty records at seventeen positions."""
HEIGHT_M = 10.0
ALWAYS = ("simulator.wind.gust_mps=0.5", "lockstep.camera_rate_hz=30")
"""Light gusts, without which no vehicle hovers outdoors and no latency shows; 1000 samples in 33 s."""


@dataclass(frozen=True)
class HoverPlace:
    """One hover."""

    distance_m: float
    """Horizontal distance from the pad's centre, metres."""
    azimuth_deg: float
    """Direction from the pad, from north, clockwise, degrees."""
    height_m: float = HEIGHT_M
    """Above the ground at home, metres: what the paper and the autopilot count."""
    heading_deg: float = 0.0
    """Where the nose points, from north, clockwise, degrees."""
    wind_mps: float = 0.0
    """Steady wind towards east; the vehicle leans into it."""
    label: str = "fit"
    """What is asked of the hover, such as `10 m`."""

    @property
    def name(self) -> str:
        """Of its recording's folder."""
        parts = (self.distance_m, self.azimuth_deg, self.height_m, self.heading_deg, self.wind_mps)
        return "_".join(f"{part:.2f}".rstrip("0").rstrip(".") for part in parts)


def paper_places() -> list[HoverPlace]:
    """The paper's twenty records at seventeen positions."""
    beside = [HoverPlace(distance, azimuth) for azimuth in DIAGONALS_DEG for distance in DISTANCES_M]
    return [HoverPlace(0.0, 0.0)] * ABOVE_THE_PAD + beside


def other_places() -> list[HoverPlace]:
    """Heights, headings and tilts that are not in the fit; as far aside of the height as the paper's two middle distances."""
    diagonals = ((0.28, DIAGONALS_DEG[::2]), (0.57, DIAGONALS_DEG[1::2]))
    places = [
        HoverPlace(part * height_m, azimuth, height_m, label=f"{height_m:g} m")
        for height_m in (3.0, 5.0, 15.0, 20.0)
        for part, azimuths in diagonals
        for azimuth in azimuths
    ]
    for heading_deg, azimuths in ((60.0, DIAGONALS_DEG[::2]), (200.0, DIAGONALS_DEG[1::2])):
        places += [HoverPlace(4.2, azimuth, heading_deg=heading_deg, label="10 m, headings") for azimuth in azimuths]
    places += [HoverPlace(4.2, azimuth, wind_mps=5.0, label="10 m, 5 m/s wind") for azimuth in DIAGONALS_DEG]
    return places


def hover_settings(
    place: HoverPlace, seed: int, environment: Mapping[str, str], assignments: Iterable[str] = ()
) -> Settings:
    """The settings of one hover; `assignments` (`section.key=value`) win.

    Raises:
        SettingsError: Naming file, key and remedy.
    """
    azimuth_rad = math.radians(place.azimuth_deg)
    wanted = [f"seed={seed}", *ALWAYS, f"simulator.wind.east_mps={place.wind_mps!r}", *assignments]
    settings = load_settings(PRESET, environment, wanted)
    if settings.simulator.airborne is not None:
        raise SettingsError("simulator.airborne: the experiment says itself where to hover")
    # `airborne` counts from the pad, the paper from the ground.
    down_m = -place.height_m + settings.simulator.pad.height_above_home_m
    start = {
        "north_m": place.distance_m * math.cos(azimuth_rad),
        "east_m": place.distance_m * math.sin(azimuth_rad),
        "down_m": down_m,
    }
    text = ", ".join(f"{key} = {value!r}" for key, value in start.items())
    heading = f"simulator.home.azimuth_deg={place.heading_deg!r}"
    return load_settings(PRESET, environment, [*wanted, heading, f"simulator.airborne={{{text}}}"])
