"""Flies the descents of an experiment in lockstep, on several cores; those that were flown before stay."""

import shutil
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import as_completed
from pathlib import Path

from schemas.settings import Settings
from station.director import FlightPlan
from station.experiment.descent import descent_settings
from station.experiment.flight_pool import flight_pool
from station.lockstep_flight import fly_lockstep

_UNFINISHED = ".unfinished"


def fly_descents(
    seeds: Sequence[int],
    folder: Path,
    environment: Mapping[str, str],
    assignments: Sequence[str] = (),
    *,
    jobs: int = 1,
    on_flown: Callable[[int, str], None] = lambda _seed, _said: None,
) -> list[Path]:
    """Fly one descent for each seed that has no recording in the folder yet.

    Args:
        seeds: One flight each.
        folder: Where the recordings are, `seed-00000` and so on.
        environment: For the settings, usually `os.environ`.
        assignments: `section.key=value`, for all flights.
        jobs: How many at a time.
        on_flown: Told of each new flight, with what to say of it.

    Returns:
        The recordings' folders, in the order of the seeds.

    Raises:
        SettingsError: Naming file, key and remedy.
    """
    folders = {seed: folder / f"seed-{seed:05d}" for seed in seeds}
    wanted = {
        seed: descent_settings(seed, environment, assignments) for seed, path in folders.items() if not path.exists()
    }
    with flight_pool(min(jobs, len(wanted))) as pool:
        flights = {pool.submit(_fly, settings, folders[seed]): seed for seed, settings in wanted.items()}
        for flight in as_completed(flights):
            on_flown(flights[flight], flight.result())
    return list(folders.values())


def _fly(settings: Settings, folder: Path) -> str:
    unfinished = folder.with_name(folder.name + _UNFINISHED)
    shutil.rmtree(unfinished, ignore_errors=True)
    recorder = settings.recorder.model_copy(update={"directory": unfinished, "frames": "none"})
    outcome = fly_lockstep(settings.model_copy(update={"recorder": recorder}), FlightPlan(takeoff_to_ned_m=None))
    unfinished.rename(folder)
    return f"{outcome.failure or 'landed'} after {outcome.flown_s:.0f} s"
