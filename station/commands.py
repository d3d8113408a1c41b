"""Commands and their actions, by name: a row says what each is for and which module describes and runs it."""

import argparse
import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    Choices = argparse._SubParsersAction[argparse.ArgumentParser]


@dataclass(frozen=True)
class Command:
    """One row."""

    name: str
    module: str
    """It has `add_arguments(parser)`, and `run(arguments) -> int` unless its arguments are commands of their own."""
    meaning: str
    """One line for the help, in lower case."""


def add_command(choices: "Choices", command: Command, words: Sequence[str] | None = None) -> None:
    """Offer a command.

    Args:
        choices: Where.
        command: The row.
        words: What was typed. A command that is not among them is named for the help, and its module is not loaded, so that
            `alight abort` does not wait for what draws reports. None loads all.
    """
    parser = choices.add_parser(command.name, help=command.meaning, description=sentence(command.meaning))
    if words is not None and command.name not in words:
        return
    module = importlib.import_module(command.module)
    if hasattr(module, "run"):
        parser.set_defaults(run=module.run)
    module.add_arguments(parser)


def sentence(meaning: str) -> str:
    """A line of the help as a sentence."""
    return meaning[0].upper() + meaning[1:] + "."
