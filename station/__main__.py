"""The command `alight`."""

import argparse
import sys
from collections.abc import Callable, Sequence
from functools import partial

from alight.runtime.service import add_service_arguments, run_service
from schemas.mission import Verb
from schemas.topics import SERVICES
from station.commands import Command, add_command, sentence

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
  alight calibrate delay flights/<time>
                             how much later than the light its frames are stamped
  alight pad print nested --paper A4 --out pad.pdf
"""

EPILOG = "Every setting is in docs/settings.md; when something is odd, docs/troubleshooting.md: symptom, cause, remedy."

Run = Callable[[argparse.Namespace], int]


def main(words: Sequence[str] | None = None) -> int:
    """Run one command; the exit status."""
    typed = sys.argv[1:] if words is None else list(words)
    arguments = parser(typed).parse_args(typed)
    run: Run = arguments.run
    try:
        return run(arguments)
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        return 0


COMMANDS = (
    Command("fly", "station.fly", "fly a landing and report on it"),
    Command("campaign", "station.campaign.command", "fly many simulated landings, on all cores or a cluster"),
    Command("detect", "station.detect", "find markers in pictures and videos"),
    Command("pad", "station.pad.command", "print a pad at true scale, or show it"),
    Command(
        "calibrate",
        "station.calibrate.command",
        "find a camera's lens, its installation's bias, or the delay of its stamps",
    ),
    Command("report", "station.report_command", "write the report of a recorded flight"),
    Command(
        "replay",
        "station.replay_command",
        "replay a recorded flight: on the bus, or through chosen services to compare and to score",
    ),
    Command("recording", "station.recording.command", "look into a recording, mend it"),
    Command(
        "experiment",
        "station.experiment.command",
        "put a question to many flights: compare filters, fit the error model",
    ),
)
"""Those whose module says all about them, in the order in which the help lists them."""
_BEFORE_FLIGHT = 2
"""So many of them come before what is done in flight."""


def parser(words: Sequence[str] | None = None) -> argparse.ArgumentParser:
    """All commands and their options; those of the commands that are not among `words` without, where `words` are given."""
    root = argparse.ArgumentParser(
        prog="alight",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = root.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for command in COMMANDS[:_BEFORE_FLIGHT]:
        add_command(commands, command, words)
    _add_run(commands)
    _add_asking(commands)
    for command in COMMANDS[_BEFORE_FLIGHT:]:
        add_command(commands, command, words)
    _add_schema(commands)
    return root


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
        command = commands.add_parser(verb.value, help=meaning, description=sentence(meaning))
        ask.add_arguments(command)
        command.set_defaults(run=partial(ask.run_verb, verb))
    command = commands.add_parser("status", help="what is on the bus, and how it is", description="Look at the bus.")
    ask.add_arguments(command)
    command.set_defaults(run=ask.run_status)


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
