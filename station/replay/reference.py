"""Makes reference flights for replay tests: `python -m station.replay.reference [DIR] [--only NAME,...]`.

Each is flown in lockstep from a seed, with a small camera at a low rate, and written with JPEG pictures. Its outputs are
then those of a replay of the stored pictures, so that they have to be met to the last bit. With `--of FLIGHT --from S --to S
--name NAME` a part of any recording becomes one in the same way.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from alight.runtime.clock import LOCKSTEP_EPOCH_NS, nanoseconds
from alight.runtime.settings_file import SettingsError, load_settings
from schemas import topics
from schemas.mission import Phase
from schemas.settings import Settings
from station.director import FlightDirector, FlightPlan
from station.lockstep_flight import at_lockstep_rate, build_node, fly_lockstep
from station.mcap_parts import FlightRecordError, StoredMessage
from station.replay.aborting_director import AbortingDirector
from station.replay.covered_camera import CoveredCamera
from station.replay.error import ReplayError
from station.replay.excerpt import write_excerpt
from station.replay.explanation import explanation
from station.replay.recording import ReplayRecording
from station.replay.replay import replay
from station.replay.rewrite import rewrite
from station.replay.text import verdict
from station.replay.tolerance import EXACT
from station.replay.update import journalled

DIRECTORY = Path("tests/replay/flights")
PLAN = FlightPlan(takeoff_to_ned_m=None)
TRUTH_PERIOD_NS = nanoseconds(0.1)

SMALL = (
    "simulator.airborne={north_m=1.5, east_m=1.0, down_m=-5.0}",
    "camera.calibration={width_px=320, height_px=240, fx_px=146.675, fy_px=146.655, cx_px=159.57, cy_px=119.57}",
    "camera.simulated.optics.noise_level=1.0",
    "lockstep.camera_rate_hz=4.0",
    "recorder.frames=jpeg",
    "recorder.jpeg_quality=25",
    "recorder.frame_rate_hz=240.0",
    "commander.link.attitude_hz=20.0",
    "commander.link.position_hz=10.0",
    "filter.window_length=3",
)
"""Half the paper's pictures in each direction, four a second; a filter that needs fewer of them; a fifth of the telemetry."""


@dataclass(frozen=True)
class Scenario:
    """One reference flight."""

    name: str
    assignments: tuple[str, ...]
    covered_s: tuple[float, float] | None = None
    """From when to when something lies on the lens, seconds since the start."""
    abort_after_s: float | None = None
    """How long after the beginning of the descent a person gives it up, seconds."""
    ends_in: Phase = Phase.LANDED
    """How it has to end."""


SCENARIOS = (
    Scenario("descent", ("seed=11", "simulator.wind={north_mps=1.0, east_mps=2.0, gust_mps=0.3}")),
    Scenario("loss", ("seed=12", "commander.stale_after_s=1.5"), covered_s=(3.0, 6.5)),
    Scenario("abort", ("seed=13",), abort_after_s=3.0, ends_in=Phase.ABORTED),
    Scenario(
        "glare",
        (
            "seed=14",
            "camera.simulated.sunlight={glare_level=175.0, glare_width_deg=5.0, azimuth_deg=215.0, elevation_deg=78.0}",
        ),
    ),
)


def make(scenario: Scenario, directory: Path) -> Path:
    """Fly one scenario and write its file, `DIRECTORY/<name>.mcap`.

    Raises:
        ReplayError: If the flight did not end as it has to, or its replay does not yield it.
        OSError: If the file cannot be written.
    """
    target = directory / f"{scenario.name}.mcap"
    with tempfile.TemporaryDirectory() as folder:
        settings = at_lockstep_rate(
            load_settings(None, {}, [*SMALL, *scenario.assignments, f"recorder.directory={folder}"])
        )
        director = _director(scenario, settings)
        fly_lockstep(settings, PLAN, camera=_camera(scenario, settings), director=director)
        phase = director.view.mission.phase if director.view.mission else None
        if phase is not scenario.ends_in:
            raise ReplayError(f"{scenario.name}: the flight ended in {phase}, not in {scenario.ends_in}")
        flown = ReplayRecording(settings.recorder.directory / settings.recorder.file_name)
        _settle(flown, target)
    return target


def take(flight: Path, begin_s: float, end_s: float, target: Path) -> None:
    """Make a part of a recording a reference flight.

    Args:
        flight: The recording.
        begin_s: Where the part begins, seconds after the recording's first message.
        end_s: Where it ends, the same.
        target: The file to write.

    Raises:
        ReplayError: If its replay does not yield it.
        OSError: If the file cannot be written.
    """
    recording = ReplayRecording(flight)
    first_ns = min(stored.logged_at_ns for stored in recording.stored)
    with tempfile.TemporaryDirectory() as folder:
        part = Path(folder) / "part.mcap"
        write_excerpt(recording, first_ns + nanoseconds(begin_s), first_ns + nanoseconds(end_s), part, _thinned())
        _settle(ReplayRecording(part), target)


def _settle(flown: ReplayRecording, target: Path) -> None:
    """Write a flight with the outputs of its replay, and see that they are those of the next one."""
    rewrite(flown, replay(flown, journalled(flown), (), EXACT), target, _thinned())
    settled = ReplayRecording(target)
    again = replay(settled, journalled(settled), (), EXACT)
    print(f"{target}: {target.stat().st_size / 1000:.0f} kB, {again.flown_s:.1f} s; {verdict(again)}")
    if not again.equal:
        raise ReplayError(f"{target}: its replay does not yield it: {' '.join(explanation(again))}")


def _director(scenario: Scenario, settings: Settings) -> FlightDirector:
    if scenario.abort_after_s is None:
        return FlightDirector(settings, PLAN)
    return AbortingDirector(settings, PLAN, scenario.abort_after_s)


def _camera(scenario: Scenario, settings: Settings) -> CoveredCamera | None:
    if scenario.covered_s is None:
        return None
    begin_ns, end_ns = (LOCKSTEP_EPOCH_NS + nanoseconds(at_s) for at_s in scenario.covered_s)
    return CoveredCamera(build_node("camera", settings), begin_ns, end_ns)


def _thinned() -> Callable[[StoredMessage], bool]:
    """Leaves out what no replay needs: health, and most of the ground truth."""
    newest_ns = 0

    def keep(stored: StoredMessage) -> bool:
        nonlocal newest_ns
        if stored.topic is topics.GROUND_TRUTH:
            if stored.stamp_ns - newest_ns < TRUTH_PERIOD_NS:
                return False
            newest_ns = stored.stamp_ns
        return stored.topic is not topics.HEALTH

    return keep


def main(words: Sequence[str] | None = None) -> int:
    """Make them all, or the named ones."""
    parser = argparse.ArgumentParser(prog="python -m station.replay.reference", description=__doc__.splitlines()[0])
    parser.add_argument("directory", type=Path, nargs="?", default=DIRECTORY, metavar="DIR")
    parser.add_argument("--only", type=lambda text: text.split(","), metavar="NAME,...")
    parser.add_argument("--of", type=Path, metavar="FLIGHT", help="take a part of this recording instead")
    parser.add_argument("--from", dest="begin_s", type=float, default=0.0, metavar="S", help="with --of: its beginning")
    parser.add_argument("--to", dest="end_s", type=float, default=1e6, metavar="S", help="with --of: its end")
    parser.add_argument("--name", default="excerpt", help="with --of: the name of the file, without .mcap")
    arguments = parser.parse_args(words)
    try:
        if arguments.of is not None:
            target = arguments.directory / f"{arguments.name}.mcap"
            take(arguments.of, arguments.begin_s, arguments.end_s, target)
            return 0
        for scenario in SCENARIOS:
            if arguments.only is None or scenario.name in arguments.only:
                make(scenario, arguments.directory)
    except (ReplayError, FlightRecordError, SettingsError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
