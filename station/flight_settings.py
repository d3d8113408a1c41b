"""The settings of one flight: presets and files, then the environment, then `--set`, then the options of `alight fly`."""

import argparse
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from alight.runtime.settings_file import SettingsError, load_settings
from schemas.settings import Settings

PRESETS = Path(__file__).parent / "presets"


def preset_names() -> tuple[str, ...]:
    """Names that `--preset` takes."""
    return tuple(sorted(path.stem for path in PRESETS.glob("*.toml")))


def add_flight_settings_arguments(parser: argparse.ArgumentParser) -> None:
    """The options that become settings."""
    group = parser.add_argument_group("settings")
    group.add_argument("--settings", type=Path, metavar="FILE", help="TOML file with settings; see docs/settings.md")
    group.add_argument("--preset", choices=preset_names(), help="settings that come with Alight, instead of --settings")
    group.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="SECTION.KEY=VALUE",
        help="set one key; repeatable; wins over the file",
    )
    group.add_argument("--seed", type=int, metavar="N", help="seed of everything random (default 0)")
    group.add_argument(
        "--wind", metavar="MPS[:GUST[:FROM_DEG]]", help="wind speed, gusts and direction, such as 3:1:270"
    )
    group.add_argument("--guidance", choices=("glide", "reposition"), help="how to come down (default glide)")
    group.add_argument("--law", choices=("exponential", "linear"), help="altitude law of --guidance reposition")
    group.add_argument(
        "--filter",
        choices=("kalman", "moving", "none", "mean", "median"),
        help="how fixes become an estimate (default kalman)",
    )


def flight_settings(
    arguments: argparse.Namespace, environment: Mapping[str, str], assignments: Sequence[str] = ()
) -> Settings:
    """Settings from everything that the command line gives; `assignments` (`section.key=value`) win over all of it.

    Raises:
        SettingsError: Naming file, key and remedy.
    """
    if arguments.preset and arguments.settings:
        raise SettingsError("--preset and --settings: give one of them; a preset is a file too, see station/presets")
    path = PRESETS / f"{arguments.preset}.toml" if arguments.preset else arguments.settings
    return load_settings(path, environment, [*arguments.set, *option_assignments(arguments), *assignments])


def option_assignments(arguments: argparse.Namespace) -> list[str]:
    """The options of `alight fly` as `section.key=value`."""
    named = {
        "seed": arguments.seed,
        "commander.guidance": arguments.guidance,
        "commander.reposition.law": arguments.law,
        "filter.method": arguments.filter,
    }
    assignments = [f"{key}={value}" for key, value in named.items() if value is not None]
    if arguments.wind is not None:
        assignments += _wind(arguments.wind)
    return assignments


def _wind(text: str) -> list[str]:
    try:
        numbers = [float(part) for part in text.split(":")]
        speed_mps, gust_mps, from_deg = (numbers + [0.0, 0.0, 0.0][len(numbers) :])[:3]
    except ValueError:
        raise SettingsError(f"--wind {text}: write MPS[:GUST[:FROM_DEG]], such as --wind 3:1:270") from None
    towards_rad = math.radians(from_deg + 180.0)
    return [
        f"simulator.wind.north_mps={speed_mps * math.cos(towards_rad)!r}",
        f"simulator.wind.east_mps={speed_mps * math.sin(towards_rad)!r}",
        f"simulator.wind.gust_mps={gust_mps!r}",
    ]
