"""How far a count has come: one line, rewritten on a terminal; now and then a line elsewhere, so that a log stays readable."""

import sys
from typing import TextIO

_LINES = 10
"""How many lines a log gets, at most, about."""


class CountProgress:
    """`12 of 200 compared`."""

    def __init__(self, what: str, total: int | None = None, stream: TextIO | None = None) -> None:
        """Say what is counted, and how many there will be if that is known."""
        self._what = what
        self._total = total
        self._stream = stream or sys.stderr
        self._on_terminal = self._stream.isatty()
        self._every = max((total or 0) // _LINES, 1)

    def show(self, done: int) -> None:
        """Tell that so many are done."""
        last = done == self._total
        text = f"{done} {self._what}" if self._total is None else f"{done} of {self._total} {self._what}"
        if self._on_terminal:
            self._stream.write(f"\r\x1b[K{text}" + ("\n" if last else ""))
        elif last or done % self._every == 0:
            self._stream.write(f"{text}\n")
        self._stream.flush()
