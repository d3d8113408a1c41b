"""How far a campaign is: one line that is rewritten on a terminal, now and then a line elsewhere."""

import math
import sys
import time
from typing import TextIO

_WIDTH = 28
_ON_TERMINAL_S, _ELSEWHERE_S = 0.2, 10.0


class ProgressBar:
    """Counts flights; the time left follows from the speed of this run."""

    def __init__(self, total: int, done_before: int, stream: TextIO = sys.stdout) -> None:
        self._total, self._before, self._stream = total, done_before, stream
        self._done, self._landed = done_before, 0
        self._flown = 0
        self._on_terminal = stream.isatty()
        self._began_s = self._shown_s = time.monotonic()

    def count(self, *, landed: bool) -> None:
        """One more flight is done."""
        self._done += 1
        self._flown += 1
        self._landed += landed
        now_s = time.monotonic()
        if now_s - self._shown_s >= (_ON_TERMINAL_S if self._on_terminal else _ELSEWHERE_S):
            self._shown_s = now_s
            self._write(now_s)

    def end(self) -> None:
        """Leave the last state standing."""
        if self._flown:
            self._write(time.monotonic())
            if self._on_terminal:
                self._stream.write("\n")
        self._stream.flush()

    def _write(self, now_s: float) -> None:
        line = progress_text(self._done, self._total, self._flown, self._landed, now_s - self._began_s)
        self._stream.write(f"\r\x1b[K{line}" if self._on_terminal else f"{line}\n")
        self._stream.flush()


def progress_text(done: int, total: int, flown: int, landed: int, elapsed_s: float) -> str:
    """The line.

    Args:
        done: Flights that are done, earlier runs included.
        total: Flights in all.
        flown: Flights of this run.
        landed: How many of these landed on the pad.
        elapsed_s: Wall seconds of this run.
    """
    filled = _WIDTH * done // total
    rate_hz = flown / elapsed_s if elapsed_s > 0.0 else 0.0
    left = f"{_duration((total - done) / rate_hz)} left" if rate_hz else "time left unknown"
    bar = f"[{'#' * filled}{'.' * (_WIDTH - filled)}]"
    return f"{bar} {done}/{total}  {landed}/{flown} landed  {rate_hz:.2f} flights/s  {left}"


def _duration(seconds: float) -> str:
    whole = math.ceil(seconds)
    if whole < 60:
        return f"{whole} s"
    minutes, rest = divmod(whole, 60)
    return f"{minutes} min {rest:02d} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"
