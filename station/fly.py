"""`alight fly`: one flight, from the start to the report."""

import argparse
import os
import sys
from datetime import UTC, datetime
from pathlib import Path

from alight.markers.layout import layout_from
from alight.runtime.bus import BusError
from alight.runtime.logs import configure_logs
from alight.runtime.settings_file import SettingsError
from schemas.message import Vector3
from schemas.settings import Settings
from station.director import FlightDirector, FlightPlan
from station.embedded_vehicle import check_kind_is_embedded, check_link_to_embedded
from station.flight_folder import LOGS, SETTINGS, flight_folder
from station.flight_record import read_flight
from station.flight_settings import add_flight_settings_arguments, flight_settings
from station.live_flight import LiveOutcome, fly_live
from station.lockstep_flight import fly_lockstep
from station.metrics.summary import summarise
from station.metrics.text import summary_lines
from station.progress import progress_line
from station.report.error import ReportError
from station.report.write import write_report
from station.supervisor import ServiceError

ALL_SERVICES = ("simulator", "commander", "camera", "detector", "geolocator", "filter", "recorder")
START_NED_M: Vector3 = (10.0, 10.0, -20.0)
"""Where the paper's flights begin, relative to the pad (Section 4.3)."""
DEFAULT_TRUTH_URL = "udpin://127.0.0.1:14550"

EPILOG = """\
examples:
  alight fly                                   land a simulated drone; nothing else is needed
  alight fly --wind 3:1 --seed 7 --lockstep    the same in wind, as fast as the machine can, repeatable
  alight fly --preset paper --guidance reposition --law exponential
                                               the paper's flight, with its errors and its correction
  alight fly --vehicle udpin://127.0.0.1:14540 --truth udpin://127.0.0.1:14550 --takeoff
                                               a PX4 SITL (SIH) that is running; its ground truth is rendered
  alight fly --vehicle serial:///dev/ttyUSB0?baud=921600 --settings drone.toml
                                               a real vehicle that already hovers in sight of the pad;
                                               drone.toml names its camera ([camera] source, calibration_file)

exit status: 0 only if the vehicle landed on the pad; 1 if not; 2 if the settings or a port are at fault.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the options."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = EPILOG
    add_flight_settings_arguments(parser)
    flight = parser.add_argument_group("flight")
    flight.add_argument(
        "--lockstep", action="store_true", help="in one process on a virtual clock: quick and repeatable"
    )
    flight.add_argument(
        "--vehicle",
        metavar="URL",
        help="a MAVLink vehicle that is already there (PX4 SITL or a real one); "
        "without it only the embedded simulator is flown",
    )
    flight.add_argument(
        "--truth",
        metavar="URL",
        help=f"with --vehicle: where a PX4 simulation gives its ground truth, usually {DEFAULT_TRUTH_URL}; "
        "the camera is then simulated",
    )
    flight.add_argument(
        "--takeoff",
        action="store_true",
        help="with --vehicle, or --without simulator or commander: arm and take off first (never done unasked)",
    )
    flight.add_argument(
        "--start",
        type=_ned,
        default=START_NED_M,
        metavar="N,E,D",
        help="where the landing starts, metres north, east, down of the pad (default 10,10,-20)",
    )
    flight.add_argument(
        "--without",
        type=lambda text: tuple(text.split(",")),
        default=(),
        metavar="SERVICE,...",
        help="services that run elsewhere, on the same bus",
    )
    flight.add_argument(
        "--connect-timeout",
        type=float,
        default=30.0,
        metavar="S",
        help="wait so long for vehicle and services (default 30)",
    )
    flight.add_argument("--timeout", type=float, default=300.0, metavar="S", help="give up after so many seconds")
    flight.add_argument("--out", type=Path, metavar="DIR", help="where to write (default flights/<time>)")


def run(arguments: argparse.Namespace) -> int:
    """Fly; the exit status."""
    try:
        _check(arguments)
        out = arguments.out or Path("flights") / datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
        settings = flight_settings(arguments, os.environ, _assignments(arguments, out))
        _check_vehicle(settings, arguments)
        _check_lockstep(settings, arguments)
        _check_camera(settings, arguments)
        if any(out.glob("*.mcap")):
            raise SettingsError(
                f"--out {out}: there is a recording already, and none is overwritten; name another folder"
            )
        return _fly(settings, arguments, out)
    except (SettingsError, BusError, ServiceError, ValueError, OSError) as error:
        sys.stderr.write(f"alight fly: {error}\n")
        return 2


def _check(arguments: argparse.Namespace) -> None:
    if arguments.lockstep and arguments.vehicle:
        raise SettingsError("--lockstep and --vehicle: a vehicle elsewhere keeps its own time; leave one out")
    if arguments.truth and not arguments.vehicle:
        raise SettingsError("--truth: only with --vehicle; the embedded simulator needs none")
    unknown = set(arguments.without) - set(ALL_SERVICES)
    if unknown:
        raise SettingsError(
            f"--without {','.join(sorted(unknown))}: no such service; there are {', '.join(ALL_SERVICES)}"
        )


def _check_vehicle(settings: Settings, arguments: argparse.Namespace) -> None:
    """Without --vehicle nothing but the embedded simulator is flown; in lockstep the two are joined by a pipe, not by a link."""
    if arguments.vehicle:
        return
    check_kind_is_embedded(settings)
    if not arguments.lockstep and "commander" not in arguments.without:
        check_link_to_embedded(settings)


def _is_all_ours(arguments: argparse.Namespace) -> bool:
    """Whether what flies is started here; a simulator or commander elsewhere may mean a vehicle that we know nothing of."""
    return not arguments.vehicle and not {"simulator", "commander"} & set(arguments.without)


def _check_lockstep(settings: Settings, arguments: argparse.Namespace) -> None:
    """On the virtual clock everything has to be in this process, and nothing of the world."""
    if arguments.lockstep and arguments.without:
        raise SettingsError(
            f"--lockstep and --without {','.join(arguments.without)}: a service elsewhere keeps its own time; leave one out"
        )
    if arguments.lockstep and settings.camera.source != "simulated":
        raise SettingsError(
            f"--lockstep and camera.source={settings.camera.source}: only the simulated camera follows the virtual clock; "
            "leave --lockstep out, or set camera.source=simulated"
        )


def _check_camera(settings: Settings, arguments: argparse.Namespace) -> None:
    rendered = settings.camera.source == "simulated" and "camera" not in arguments.without
    told_truth = arguments.truth or "simulator" in arguments.without
    if arguments.vehicle and not told_truth and rendered:
        raise SettingsError(
            "camera.source is `simulated`, but --vehicle is flown: set camera.source=device or stream (docs/cameras.md); "
            f"for a PX4 simulation give its ground truth with --truth {DEFAULT_TRUTH_URL}; "
            "where the camera runs elsewhere say --without camera"
        )


def _assignments(arguments: argparse.Namespace, out: Path) -> list[str]:
    assignments = [f"recorder.directory={out}"]
    if arguments.vehicle:
        assignments.append(f"commander.vehicle_url={arguments.vehicle}")
    if arguments.truth:
        assignments += ["simulator.kind=mavlink_truth", f"simulator.truth_url={arguments.truth}"]
    return assignments


def _fly(settings: Settings, arguments: argparse.Namespace, out: Path) -> int:
    with flight_folder(out):
        outcome = _outcome(settings, arguments, out)
    return conclude(outcome, out)


def _outcome(settings: Settings, arguments: argparse.Namespace, out: Path) -> LiveOutcome:
    configure_logs("station", out / LOGS / "station.jsonl")
    plan = _plan(settings, arguments)
    print(f"Alight: landing on {_pad_text(settings)}; writing {out}")
    if arguments.lockstep:
        flown = fly_lockstep(settings, plan, _print_progress)
        print(
            f"\nflew {flown.flown_s:.1f} s in {flown.took_s:.1f} s ({flown.flown_s / flown.took_s:.1f} times real time)"
        )
        return LiveOutcome(flown.failure)
    settings_file = out / SETTINGS
    settings_file.write_text(settings.model_dump_json(indent=2), encoding="utf-8")
    return fly_live(settings, plan, _services(settings, arguments), settings_file, out / LOGS)


def _pad_text(settings: Settings) -> str:
    layout = layout_from(settings.pad)
    largest, others = layout.markers[0], len(layout.markers) - 1
    text = f"marker {largest.family} id {largest.id}, side {largest.side_m:g} m"
    return f"pad {layout.name}: {text}, and {others} smaller" if others else text


def conclude(outcome: LiveOutcome, out: Path) -> int:
    """Summarise the recording, write the report, say how it went; the exit status."""
    if not any(out.glob("*.mcap")):
        sys.stderr.write(f"alight fly: {outcome.failure or 'the recorder wrote nothing'}; logs are in {out / LOGS}\n")
        return 1
    record = read_flight(out)
    summary = summarise(record)
    for line in summary_lines(summary):
        print(line)
    for incident in outcome.incidents:
        print(f"incident   {incident.service} {incident.cause} and was started again")
    report = out / "report.html"
    print(f"recording  {', '.join(str(path) for path in sorted(out.glob('*.mcap')))}")
    try:
        write_report(record, summary, report)
        print(f"report     {report}")
    except ReportError as error:
        print(f"no report: {error}")
    if outcome.failure:
        sys.stderr.write(f"alight fly: not landed: {outcome.failure}\n")
        return 1
    return 0 if summary.verdict.ok else 1


def _services(settings: Settings, arguments: argparse.Namespace) -> tuple[str, ...]:
    needs_simulator = not arguments.vehicle or settings.simulator.kind == "mavlink_truth"
    wanted = [name for name in ALL_SERVICES if name != "simulator" or needs_simulator]
    return tuple(name for name in wanted if name not in arguments.without)


def _plan(settings: Settings, arguments: argparse.Namespace) -> FlightPlan:
    goes_up = arguments.takeoff or _is_all_ours(arguments)
    pad = settings.simulator.pad
    north_m, east_m, down_m = arguments.start
    start_ned_m = (pad.north_m + north_m, pad.east_m + east_m, down_m - pad.height_above_home_m)
    return FlightPlan(start_ned_m if goes_up else None, arguments.connect_timeout, arguments.timeout)


def _print_progress(director: FlightDirector) -> None:
    if sys.stdout.isatty():
        sys.stdout.write(f"\r\x1b[K{progress_line(director.stage, director.view)}")
        sys.stdout.flush()


def _ned(text: str) -> Vector3:
    try:
        north_m, east_m, down_m = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: write N,E,D in metres, such as 10,10,-20") from None
    return north_m, east_m, down_m
