"""One descent of an experiment: wind, start and errors of the installation drawn from its seed."""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path

from alight.runtime.seed import generator
from alight.runtime.settings_file import load_settings
from schemas.settings import Settings

SETTINGS = Path(__file__).with_name("descent.toml")

MOUNT_TILT_DEG = 0.2
"""Standard deviation of the camera mount's roll and of its pitch."""
MOUNT_YAW_DEG = 0.5
"""The same of its yaw."""
FOCAL_FRACTION = 0.002
"""The same of the true focal length, as a part of the calibrated one."""
FASTEST_WIND_MPS = 5.0
LOWEST_START_M, HIGHEST_START_M = 12.0, 20.0
FARTHEST_START = 0.45
"""Horizontal distance of the start from the pad's axis at most, as a part of the height: the pad is in view."""


def descent_settings(seed: int, environment: Mapping[str, str], assignments: Iterable[str] = ()) -> Settings:
    """The settings of one descent; `assignments` (`section.key=value`) win.

    Raises:
        SettingsError: Naming file, key and remedy.
    """
    return load_settings(SETTINGS, environment, [f"seed={seed}", *_drawn(seed), *assignments])


def _drawn(seed: int) -> list[str]:
    random = generator(seed, "experiment.descent")
    wind_mps, towards = random.uniform(0.0, FASTEST_WIND_MPS), random.uniform(0.0, math.tau)
    height_m = random.uniform(LOWEST_START_M, HIGHEST_START_M)
    aside_m, azimuth = random.uniform(0.0, FARTHEST_START) * height_m, random.uniform(0.0, math.tau)
    roll, pitch, yaw, focal = random.standard_normal(4).tolist()
    start = {"north_m": aside_m * math.cos(azimuth), "east_m": aside_m * math.sin(azimuth), "down_m": -height_m}
    return [
        f"simulator.wind.north_mps={wind_mps * math.cos(towards)!r}",
        f"simulator.wind.east_mps={wind_mps * math.sin(towards)!r}",
        f"simulator.airborne={{{', '.join(f'{key} = {value!r}' for key, value in start.items())}}}",
        f"simulator.installation.mount_roll_deg={MOUNT_TILT_DEG * roll!r}",
        f"simulator.installation.mount_pitch_deg={MOUNT_TILT_DEG * pitch!r}",
        f"simulator.installation.mount_yaw_deg={MOUNT_YAW_DEG * yaw!r}",
        f"simulator.installation.lens_scale={1.0 + FOCAL_FRACTION * focal!r}",
    ]
