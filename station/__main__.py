"""The command `alight`."""

import argparse
import sys
from collections.abc import Callable, Sequence
from functools import partial

from alight.runtime.service import add_service_arguments, run_service
from schemas.mission import Verb
from schemas.topics import SERVICES

DESCRIPTION = """\
Alight lands a multirotor on a printed marker, by one camera, through the autopilot's own position guidance.

Five small processes pass messages to each other (Zenoh; on one machine or on several):

  camera -> detector -> geolocator -> filter -> commander -> MAVLink -> PX4
  frames    marker      where on      smoothed   glides down, holds
            corners     the earth     estimate   when in doubt

start here:
  alight fly                 land a simulated drone, write a recording and a report with pictures
  alight fly --help          wind, seeds, the paper's flights, a PX4 SITL, a real vehicle
  alight campaign SPEC.toml  many simulated landings, and how many of them went well
  alight detect IMAGE...     what the detector sees in your own pictures

in flight, from any machine on the bus:
  alight status | land | hold | abort

afterwards:
  alight report flights/<time>/flight.mcap
  alight replay flights/<time> --through detector,geolocator,filter,commander
                             do the services of today still say what they said?
  alight recording info flights/<time>

for your own camera and pad:
  alight calibrate camera PICTURES --board chessboard:9x6:0.20
  alight pad print nested --paper A4 --out pad.pdf
"""

EPILOG = "Every setting is in docs/settings.md; when something is odd, docs/troubleshooting.md: symptom, cause, remedy."

Run = Callable[[argparse.Namespace], int]


def main(words: Sequence[str] | None = None) -> int:
    """Run one command; the exit status."""
    arguments = parser().parse_args(words)
    run: Run = arguments.run
    try:
        return run(arguments)
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        return 0


def parser() -> argparse.ArgumentParser:
    """All commands and their options."""
    root = argparse.ArgumentParser(
        prog="alight",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = root.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_fly(commands)
    _add_campaign(commands)
    _add_run(commands)
    _add_asking(commands)
    _add_detect(commands)
    _add_pad(commands)
    _add_calibrate(commands)
    _add_report(commands)
    _add_replay(commands)
    _add_recording(commands)
    _add_experiment(commands)
    _add_schema(commands)
    return root


def _add_fly(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station import fly  # noqa: PLC0415 - each command loads what it needs, so that --help is quick

    command = commands.add_parser(
        "fly", help="fly a landing and report on it", description="Fly a landing and report on it."
    )
    fly.add_arguments(command)
    command.set_defaults(run=fly.run)


def _add_campaign(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station.campaign import command as campaign  # noqa: PLC0415

    meaning = "fly many simulated landings, on all cores or a cluster"
    command = commands.add_parser("campaign", help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
    campaign.add_arguments(command)
    command.set_defaults(run=campaign.run)


def _add_run(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    command = commands.add_parser("run", help="run one service in this process", description="Run one service here.")
    command.add_argument("service", choices=sorted(SERVICES))
    add_service_arguments(command)
    command.set_defaults(run=lambda arguments: run_service(arguments.service, arguments))


def _add_asking(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station import ask  # noqa: PLC0415

    meanings = {
        Verb.LAND: "ask the commander to land on the pad",
        Verb.HOLD: "ask it to hold where it is",
        Verb.ABORT: "ask it to give the landing up and hold",
    }
    for verb, meaning in meanings.items():
        command = commands.add_parser(verb.value, help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
        ask.add_arguments(command)
        command.set_defaults(run=partial(ask.run_verb, verb))
    command = commands.add_parser("status", help="what is on the bus, and how it is", description="Look at the bus.")
    ask.add_arguments(command)
    command.set_defaults(run=ask.run_status)


def _add_detect(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station import detect  # noqa: PLC0415

    meaning = "find markers in pictures and videos"
    command = commands.add_parser("detect", help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
    detect.add_arguments(command)
    command.set_defaults(run=detect.run)


def _add_pad(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station.pad import command as pad  # noqa: PLC0415

    command = commands.add_parser(
        "pad", help="print a pad at true scale, or show it", description="Print or show a pad."
    )
    pad.add_arguments(command)


def _add_calibrate(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station.calibrate import command as calibrate  # noqa: PLC0415

    meaning = "calibrate a camera from pictures of a board"
    command = commands.add_parser("calibrate", help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
    calibrate.add_arguments(command)


def _add_report(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station import report_command  # noqa: PLC0415

    meaning = "write the report of a recorded flight"
    command = commands.add_parser("report", help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
    report_command.add_arguments(command)
    command.set_defaults(run=report_command.run)


def _add_recording(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station.recording import command as recording  # noqa: PLC0415

    meaning = "look into a recording, mend it"
    command = commands.add_parser("recording", help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
    recording.add_actions(command)


def _add_replay(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station import replay_command  # noqa: PLC0415

    meaning = "replay a recorded flight: on the bus, or through chosen services to compare and to score"
    command = commands.add_parser("replay", help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
    replay_command.add_arguments(command)
    command.set_defaults(run=replay_command.run)


def _add_experiment(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station.experiment import command as experiment  # noqa: PLC0415

    meaning = "put a question to many flights: compare filters"
    command = commands.add_parser("experiment", help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
    experiment.add_actions(command)


def _add_schema(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station import schema_export  # noqa: PLC0415

    command = commands.add_parser(
        "schema", help="export the messages' JSON Schemas", description="The messages' schemas."
    )
    actions = command.add_subparsers(title="actions", metavar="ACTION", required=True)
    export = actions.add_parser(
        "export", help="write them to a folder", description="Write the JSON Schemas to a folder."
    )
    schema_export.add_arguments(export)
    export.set_defaults(run=schema_export.run)


if __name__ == "__main__":
    sys.exit(main())
