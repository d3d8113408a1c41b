"""`alight recording ACTION`: one function for each action, in the order in which the help lists them."""

import argparse


def add_actions(command: argparse.ArgumentParser) -> None:
    """Describe `alight recording` and its actions."""
    actions = command.add_subparsers(title="actions", metavar="ACTION", required=True)
    for add in (_add_info, _add_doctor, _add_repair, _add_import, _add_settings, _add_migrate):
        add(actions)


def _add_info(actions: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station.recording import info  # noqa: PLC0415 - each action loads what it needs, so that --help is quick

    meaning = "say what is in a recording, and what is missing"
    action = actions.add_parser("info", help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
    info.add_arguments(action)
    action.set_defaults(run=info.run)


def _add_doctor(actions: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station.recording import doctor  # noqa: PLC0415

    meaning = "check that a recording is an MCAP file to the letter"
    action = actions.add_parser("doctor", help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
    doctor.add_arguments(action)
    action.set_defaults(run=doctor.run)


def _add_repair(actions: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station.recording import repair  # noqa: PLC0415

    meaning = "make a whole, indexed file of one that was cut short"
    action = actions.add_parser("repair", help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
    repair.add_arguments(action)
    action.set_defaults(run=repair.run)


def _add_import(actions: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station.recording_import import command  # noqa: PLC0415

    meaning = "make a recording of an autopilot's log and a video"
    action = actions.add_parser("import", help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
    command.add_arguments(action)
    action.set_defaults(run=command.run)


def _add_settings(actions: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station.recording import settings  # noqa: PLC0415

    meaning = "print the settings of a flight, for --settings"
    action = actions.add_parser("settings", help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
    settings.add_arguments(action)
    action.set_defaults(run=settings.run)


def _add_migrate(actions: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    from station.migration import command  # noqa: PLC0415

    action = actions.add_parser("migrate", help="write an old recording with today's messages, for other programs")
    command.add_arguments(action)
    action.set_defaults(run=command.run)
