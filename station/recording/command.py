"""`alight recording ACTION`: look into recordings and mend them."""

import argparse

from station.commands import Command, add_command

ACTIONS = (
    Command("info", "station.recording.info", "say what is in a recording, and what is missing"),
    Command("doctor", "station.recording.doctor", "check that a recording is an MCAP file to the letter"),
    Command("repair", "station.recording.repair", "make a whole, indexed file of one that was cut short"),
    Command("import", "station.recording_import.command", "make a recording of an autopilot's log and a video"),
    Command("settings", "station.recording.settings", "print the settings of a flight, for --settings"),
    Command("migrate", "station.migration.command", "write an old recording with today's messages, for other programs"),
)
"""In the order in which the help lists them."""


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Describe the actions."""
    choices = command.add_subparsers(title="actions", metavar="ACTION", required=True)
    for action in ACTIONS:
        add_command(choices, action)
