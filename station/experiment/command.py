"""`alight experiment ...`: one question each, answered by a table, figures and the numbers behind them."""

import argparse

from station.experiment import error_model_command, filters_command


def add_actions(parser: argparse.ArgumentParser) -> None:
    """One action an experiment."""
    actions = parser.add_subparsers(title="experiments", metavar="EXPERIMENT", required=True)
    meaning = "compare filters on the same fixes, against the truth"
    filters = actions.add_parser("filters", help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
    filters_command.add_arguments(filters)
    filters.set_defaults(run=filters_command.run)
    meaning = "fit the paper's error model and ours to static hovers, beside the published tables"
    error_model = actions.add_parser("error-model", help=meaning, description=meaning[0].upper() + meaning[1:] + ".")
    error_model_command.add_arguments(error_model)
    error_model.set_defaults(run=error_model_command.run)
