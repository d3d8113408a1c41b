"""`alight experiment ...`: one question each, answered by a table, figures and the numbers behind them."""

import argparse

from station.commands import Command, add_command

EXPERIMENTS = (
    Command("filters", "station.experiment.filters_command", "compare filters on the same fixes, against the truth"),
    Command(
        "error-model",
        "station.experiment.error_model_command",
        "fit the paper's error model and ours to static hovers, beside the published tables",
    ),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """One action an experiment."""
    choices = parser.add_subparsers(title="experiments", metavar="EXPERIMENT", required=True)
    for experiment in EXPERIMENTS:
        add_command(choices, experiment)
