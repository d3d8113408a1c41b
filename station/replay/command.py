"""`alight replay FLIGHT --through ...`: a recorded flight through the nodes of today."""

import argparse
import json
import sys
from pathlib import Path

from alight.runtime.settings_file import SettingsError
from station.mcap_parts import FlightRecordError
from station.replay.error import ReplayError
from station.replay.recording import ReplayRecording
from station.replay.replay import replay
from station.replay.result import ReplayResult
from station.replay.score import Score, Scorer
from station.replay.text import as_json, result_lines, score_lines
from station.replay.tolerance import BY_NAME
from station.replay.update import update
from station.report.error import ReportError

EPILOG = """\
through the nodes of today:
  alight replay FLIGHT --through detector,geolocator,filter,commander
                                     do they still say what they said? exit status 0 only if so
  alight replay FLIGHT --through geolocator,filter --report DIR
                                     the same, with a page of pictures
  alight replay FLIGHT --through filter --set filter.method=median
                                     what would the flight have been worth with another filter?
  alight replay FLIGHT... --update   let reference flights expect what the nodes say today

docs/replay.md says more.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the options of a replay through nodes."""
    parser.epilog = EPILOG
    group = parser.add_argument_group("through the nodes of today")
    group.add_argument(
        "--through",
        type=lambda text: tuple(text.split(",")),
        default=(),
        metavar="SERVICE,...",
        help="feed these nodes what they were given in flight (detector, geolocator, filter, commander) and compare what they say",
    )
    group.add_argument("--report", type=Path, metavar="DIR", help="with --through: write a page with pictures there")
    group.add_argument("--json", action="store_true", help="with --through: print the outcome as JSON")
    group.add_argument(
        "--tolerance",
        choices=sorted(BY_NAME),
        help="with --through: how much may differ: nothing, what another machine rounds otherwise, or what lossy pictures cost "
        "(default: exact, but lossy where the detector gets JPEG pictures)",
    )
    group.add_argument(
        "--update",
        action="store_true",
        help="let the recordings expect what the nodes say today; shows the difference and asks first",
    )
    group.add_argument("--yes", action="store_true", help="with --update: do not ask")


def run(arguments: argparse.Namespace) -> int:
    """Replay each flight; 0 only if all are equal within tolerance (with --set: if all could be replayed)."""
    try:
        return max([_run_one(path, arguments) for path in arguments.flights])
    except (FlightRecordError, ReplayError, SettingsError, ReportError, OSError) as error:
        sys.stderr.write(f"alight replay: {error}\n")
        return 2


def _run_one(path: Path, arguments: argparse.Namespace) -> int:
    recording = ReplayRecording(path)
    if arguments.update:
        return update(recording, arguments.through, arguments.set, unasked=arguments.yes)
    result = replay(recording, arguments.through, arguments.set, BY_NAME.get(arguments.tolerance))
    scores = _scores(recording, result) if arguments.set or arguments.report else None
    if arguments.json:
        print(json.dumps({"flight": str(recording.path), **as_json(result, scores)}, indent=1))
    else:
        _print(recording, result, scores if arguments.set else None)
    if arguments.report:
        _write_report(recording, result, scores, arguments.report)
    return 0 if result.equal or arguments.set else 1


def _scores(recording: ReplayRecording, result: ReplayResult) -> tuple[Score, Score]:
    scorer = Scorer(recording)
    return scorer.recorded(), scorer.replayed(result)


def _print(recording: ReplayRecording, result: ReplayResult, scores: tuple[Score, Score] | None) -> None:
    print(recording.path)
    for line in result_lines(result):
        print(line)
    if scores is not None:
        print()
        for line in score_lines(*scores):
            print(line)


def _write_report(
    recording: ReplayRecording, result: ReplayResult, scores: tuple[Score, Score] | None, directory: Path
) -> None:
    from station.replay.page import write_page  # noqa: PLC0415 - loads matplotlib, which is an extra

    page = write_page(recording, result, scores, directory)
    print(f"report: {page}", file=sys.stderr)
