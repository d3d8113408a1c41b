"""A minute of flight through the nodes of today: how many times faster than it was flown."""

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from alight.runtime.settings_file import load_settings
from station.bench.table import print_table
from station.director import FlightPlan
from station.lockstep_flight import fly_lockstep
from station.replay.recording import ReplayRecording
from station.replay.replay import replay

LONG = (
    "simulator.airborne={north_m=10.0, east_m=10.0, down_m=-30.0}",
    "commander.glide.descent_mps=0.5",
    "commander.glide.slow_mps=0.4",
    "camera.rate_hz=30.0",
    "lockstep.camera_rate_hz=30.0",
    "recorder.frame_rate_hz=240.0",
    "seed=1",
)
"""A slow descent from high up, thirty frames a second, each picture kept."""
CASES: tuple[tuple[str, ...], ...] = (
    ("geolocator", "filter", "commander"),
    ("geolocator",),
    ("filter",),
    ("commander",),
    ("detector",),
    ("detector", "geolocator", "filter", "commander"),
)
GOALS = {CASES[0]: 10.0, CASES[-1]: 3.0}


def bench_replay() -> None:
    """Fly, replay and print."""
    with tempfile.TemporaryDirectory() as folder:
        settings = load_settings(None, {}, [*LONG, f"recorder.directory={folder}"])
        fly_lockstep(settings, FlightPlan(takeoff_to_ned_m=None))
        path = settings.recorder.directory / settings.recorder.file_name
        rows = [_row(path, services) for services in CASES]
    title = "A lockstep flight at 30 frames a second (640x480, JPEG) replayed; reading the file is included"
    head = ("through", "flown, s", "took, s", "times real time", "of the processor", "goal", "messages compared")
    print_table(title, head, rows)
    print("`of the processor` counts this process's own time: on a machine that others use, too, it says more.")


def _row(path: Path, services: Sequence[str]) -> tuple[str, ...]:
    began_s, began_cpu_s = time.perf_counter(), time.process_time()
    result = replay(ReplayRecording(path), services)
    took_s, cpu_s = time.perf_counter() - began_s, time.process_time() - began_cpu_s
    goal = GOALS.get(tuple(services))
    return (
        ", ".join(services),
        f"{result.flown_s:.1f}",
        f"{took_s:.2f}",
        f"{result.flown_s / took_s:.1f}",
        f"{result.flown_s / cpu_s:.1f}",
        f">= {goal:g}" if goal else "",
        str(sum(count.same + count.tolerated + count.different for count in result.counts.values())),
    )
