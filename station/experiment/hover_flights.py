"""Flies hovers in lockstep, on several cores; those that were flown before stay."""

import shutil
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import as_completed
from pathlib import Path

from schemas.settings import Settings
from station.biases.recorded_hover import SETTLED_AFTER_S
from station.director import FlightPlan
from station.experiment.flight_pool import flight_pool
from station.experiment.hover_director import HoverDirector
from station.experiment.hover_plan import HoverPlace, hover_settings
from station.lockstep_flight import fly_lockstep

_UNFINISHED = ".unfinished"
_SPARE = 1.03
"""A few frames give no fix."""
CONNECTING_S = 1.0


def fly_hovers(
    places: Sequence[HoverPlace],
    samples: int,
    first_seed: int,
    folder: Path,
    environment: Mapping[str, str],
    assignments: Sequence[str] = (),
    *,
    jobs: int = 1,
    on_flown: Callable[[int], None] = lambda _done: None,
) -> list[Path]:
    """Fly one hover for each place; each has a seed of its own.

    Args:
        places: Where.
        samples: Frames of each.
        first_seed: Of the first place.
        folder: Where the recordings go.
        environment: For the settings, usually `os.environ`.
        assignments: `section.key=value`, for all flights.
        jobs: How many at a time.
        on_flown: Told how many there are, those from before included.

    Returns:
        The recordings' folders, in the order of the places.

    Raises:
        SettingsError: Naming file, key and remedy.
    """
    folders = [folder / f"{first_seed + number:04d}_{samples}_{place.name}" for number, place in enumerate(places)]
    wanted = {
        path: hover_settings(place, first_seed + number, environment, assignments)
        for number, (place, path) in enumerate(zip(places, folders, strict=True))
        if not path.exists()
    }
    with flight_pool(min(jobs, len(wanted))) as pool:
        flights = [pool.submit(_fly, settings, samples, path) for path, settings in wanted.items()]
        for done, flight in enumerate(as_completed(flights), start=len(folders) - len(wanted) + 1):
            flight.result()
            on_flown(done)
    return folders


def _fly(settings: Settings, samples: int, folder: Path) -> None:
    unfinished = folder.with_name(folder.name + _UNFINISHED)
    shutil.rmtree(unfinished, ignore_errors=True)
    recorder = settings.recorder.model_copy(update={"directory": unfinished, "frames": "none"})
    settings = settings.model_copy(update={"recorder": recorder})
    rate_hz = min(settings.camera.rate_hz, settings.lockstep.camera_rate_hz)
    hover_s = CONNECTING_S + SETTLED_AFTER_S + _SPARE * samples / rate_hz
    fly_lockstep(settings, FlightPlan(takeoff_to_ned_m=None), director=HoverDirector(settings, hover_s))
    unfinished.rename(folder)
