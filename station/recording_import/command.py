"""`alight recording import LOG --video FILE ...`: a flight that other programs recorded becomes a recording like our own."""

import argparse
import os
import sys
from pathlib import Path

from alight.runtime.clock import nanoseconds
from alight.runtime.settings_file import SettingsError, load_settings
from schemas.settings import Settings
from schemas.settings.camera import Calibration
from services.camera.calibration_file import configured_calibration, read_calibration
from station.recording_import.source_error import SourceError
from station.recording_import.stamps import moment_ns, stamps_at_rate, stamps_from_table
from station.recording_import.vehicle import Vehicle, check_overlap, vehicle_of
from station.recording_import.video import Film, camera_heard, rate_of
from station.recording_import.words import about_film, about_vehicle
from station.recording_import.write import write

EPILOG = """\
examples:
  alight recording import flight.tlog --video flight.mp4 --stamps frames.csv --calibration camera.toml --out flight.mcap
  alight recording import log.ulg --video flight.mp4 --fps 30 --video-start +12.4 --offset -0.05 --out flight.mcap
  alight replay flight.mcap --through detector,geolocator,filter
"""

EVERYTHING_IN_ONE_FILE = tuple(
    f"recorder.{key}=0" for key in ("frame_rate_hz", "rotate_mb", "rotate_s", "quota_mb", "pre_trigger_s")
)
"""Settings that a recorder in flight may need, but that would lose parts of an import or of the recordings beside it."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the options."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = EPILOG
    parser.add_argument("log", type=Path, metavar="LOG", help="PX4's own log (.ulg) or a MAVLink telemetry log (.tlog)")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.mcap", help="the recording to write")
    video = parser.add_argument_group("video")
    video.add_argument(
        "--video", action="append", default=[], metavar="FILE", help="video, picture or folder of pictures; repeatable"
    )
    video.add_argument("--stamps", type=Path, metavar="FILE.csv", help="when each frame was taken; see docs/replay.md")
    video.add_argument("--fps", type=_rate, metavar="N", help="frames a second, where there are no stamps")
    video.add_argument(
        "--video-start",
        default="+0",
        metavar="TIME",
        help="when the first frame was taken: +SECONDS after the log's first pose, or UTC (default +0)",
    )
    video.add_argument("--offset", type=float, default=0.0, metavar="S", help="take every frame for S seconds later")
    video.add_argument(
        "--calibration", type=Path, metavar="FILE", help="the camera's calibration, TOML or OpenCV's YAML"
    )
    video.add_argument(
        "--latency", type=_latency, default=0.02, metavar="S", help="from exposure until a frame is out (default 0.02)"
    )
    video.add_argument("--mirrored", action="store_true", help="the pictures are mirror images")
    parser.add_argument("--settings", type=Path, metavar="FILE", help="TOML file with settings: pad, mount, camera")
    parser.add_argument(
        "--set", action="append", default=[], metavar="SECTION.KEY=VALUE", help="set one key; repeatable"
    )


def run(arguments: argparse.Namespace) -> int:
    """Import; the exit status."""
    try:
        settings = _settings(arguments)
        vehicle = vehicle_of(arguments.log, settings)
        film = _film(arguments, settings, vehicle)
        camera = camera_heard(film) if film is not None else ()
        counts = write((vehicle.heard, camera), settings)
    except (SettingsError, SourceError, ValueError, OSError) as error:
        sys.stderr.write(f"alight recording import: {error}\n")
        return 2
    for line in (*about_vehicle(vehicle, settings), *about_film(film, counts)):
        print(line)
    print(f"recording  {arguments.out}: {', '.join(f'{name} ({count})' for name, count in sorted(counts.items()))}")
    return 0


def _settings(arguments: argparse.Namespace) -> Settings:
    out: Path = arguments.out
    if out.exists():
        raise SourceError(f"--out {out}: there is a recording already, and none is overwritten; name another file")
    given = [f"recorder.directory={out.parent}", f"recorder.file_name={out.name}", *EVERYTHING_IN_ONE_FILE]
    settings = load_settings(arguments.settings, os.environ, [*arguments.set, *given])
    calibration = configured_calibration(settings.camera)
    if arguments.calibration is not None:
        calibration = read_calibration(arguments.calibration, "--calibration")
    # The recording carries the numbers themselves: the file may be gone when it is replayed.
    believed = Calibration.model_validate(calibration.model_dump(exclude={"at_ns"}))
    camera = settings.camera.model_copy(update={"calibration": believed, "calibration_file": "", "source": "files"})
    return settings.model_copy(update={"camera": camera})


def _film(arguments: argparse.Namespace, settings: Settings, vehicle: Vehicle) -> Film | None:
    if not arguments.video:
        return None
    start_ns = moment_ns(arguments.video_start, vehicle.first_ns)
    offset_ns = nanoseconds(arguments.offset)
    table: list[int] | None = None
    if arguments.stamps is not None:
        table = [stamp_ns + offset_ns for stamp_ns in stamps_from_table(arguments.stamps, start_ns)]
        check_overlap(table[0], table[-1], vehicle)
    else:
        check_overlap(start_ns + offset_ns, None, vehicle)
    return Film(
        paths=tuple(arguments.video),
        stamps_ns=table or stamps_at_rate(start_ns + offset_ns, arguments.fps or rate_of(arguments.video[0])),
        calibration=configured_calibration(settings.camera),
        latency_s=arguments.latency,
        mirrored=arguments.mirrored,
    )


def _rate(text: str) -> float:
    rate_hz = float(text)
    if not 0.1 <= rate_hz <= 1000.0:
        raise argparse.ArgumentTypeError("between 0.1 and 1000")
    return rate_hz


def _latency(text: str) -> float:
    latency_s = float(text)
    if not 0.0 <= latency_s <= 5.0:
        raise argparse.ArgumentTypeError("between 0 and 5 seconds")
    return latency_s
