"""What a person watches while a flight goes on: one line, rewritten on a terminal, printed once a second elsewhere."""

import sys
import time
from typing import TextIO

from schemas.mission import Phase
from station.director import FlightDirector, Stage, View

SPINNER = "|/-\\"


class Progress:
    """Shows where a flight is."""

    def __init__(self, director: FlightDirector, stream: TextIO = sys.stdout) -> None:
        self._director = director
        self._stream = stream
        self._on_terminal = stream.isatty()
        self._shown_s = 0.0
        self._last_phase: Phase | None = None
        self._turn = 0

    def show(self, started_s: float) -> None:
        """Show the newest state; called often, writes as often as suits the stream."""
        now_s = time.monotonic()
        self._show_phase_change()
        if now_s - self._shown_s < (0.2 if self._on_terminal else 1.0):
            return
        self._shown_s = now_s
        self._turn += 1
        line = f"{now_s - started_s:5.1f} s  {progress_line(self._director.stage, self._director.view)}"
        if self._on_terminal:
            self._stream.write(f"\r\x1b[K{SPINNER[self._turn % 4]} {line}")
        else:
            self._stream.write(line + "\n")
        self._stream.flush()

    def say(self, text: str) -> None:
        """Write a line that stays."""
        self._stream.write(("\r\x1b[K" if self._on_terminal else "") + text + "\n")
        self._stream.flush()

    def _show_phase_change(self) -> None:
        mission = self._director.view.mission
        if mission is not None and mission.phase is not self._last_phase:
            self._last_phase = mission.phase
            self.say(f"-> {mission.phase}: {mission.reason}")


def progress_line(stage: Stage, view: View) -> str:
    """Phase, height, distance, detection rate and age of the estimate in one line."""
    mission = view.mission
    if mission is None:
        return stage.value
    parts = [f"{mission.phase:<9}"]
    if mission.height_above_pad_m is not None and mission.distance_to_pad_m is not None:
        parts.append(f"height {mission.height_above_pad_m:5.1f} m  distance {mission.distance_to_pad_m:5.2f} m")
    parts.append(f"pad in {_share(view):3.0f} % of {view.frames_seen} frames")
    if mission.estimate_age_s is not None:
        parts.append(f"estimate {min(mission.estimate_age_s, 99.0):4.2f} s old")
    return "  ".join(parts)


def _share(view: View) -> float:
    return 100.0 * view.frames_with_pad / view.frames_seen if view.frames_seen else 0.0
