"""Starts every service as a process of its own, restarts one that dies, stops them all."""

import subprocess
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from alight.runtime.priority import hasten

SETTLED_S = 5.0
"""A service that ran at least this long and then died is restarted at once."""
BACK_OFF_S = (0.0, 0.5, 1.0, 2.0, 5.0)
"""Pause before the first, second, ... restart in a row; a landing must not wait long for its services."""
STOP_TIMEOUT_S = 6.0
BAD_SETTINGS_STATUS = 2


class ServiceError(Exception):
    """A service that cannot start: its own words."""


@dataclass(frozen=True)
class Incident:
    """A service that died and was started again."""

    service: str
    at_monotonic_s: float
    status: int
    """Exit status; negative is the number of the signal that killed it."""

    @property
    def cause(self) -> str:
        """In words."""
        return f"killed by signal {-self.status}" if self.status < 0 else f"exited with status {self.status}"


@dataclass
class _Child:
    service: str
    process: subprocess.Popen[bytes]
    log: IO[bytes]
    started_s: float
    restarts_in_a_row: int = 0
    restart_at_s: float | None = None


@dataclass
class Supervisor:
    """Owns the service processes of one flight."""

    settings_file: Path
    log_directory: Path
    real_time: bool = False
    """Whether a service that is started again gets its real-time priority at once, not only when it has loaded."""
    incidents: list[Incident] = field(default_factory=list)
    _children: dict[str, _Child] = field(default_factory=dict)

    def start(self, services: Iterable[str]) -> None:
        """Start the services, each logging to `<log_directory>/<service>.jsonl`."""
        self.log_directory.mkdir(parents=True, exist_ok=True)
        for service in services:
            self._children[service] = self._spawn(service)

    def watch(self) -> None:
        """Restart what died; to be called several times a second.

        Raises:
            ServiceError: If a service says that its settings or a port are at fault: no restart mends that.
        """
        now_s = time.monotonic()
        for child in list(self._children.values()):
            status = child.process.poll()
            if status is None:
                continue
            if child.restart_at_s is None:
                self._note_death(child, status, now_s)
            elif now_s >= child.restart_at_s:
                fresh = self._spawn(child.service)
                fresh.restarts_in_a_row = child.restarts_in_a_row
                if self.real_time:
                    hasten(fresh.process.pid, child.service)
                self._children[child.service] = fresh

    def stop(self, last: Iterable[str] = ("simulator", "recorder")) -> None:
        """Ask all services to stop and wait for them; those named `last` stop last, in that order."""
        last = tuple(last)
        waves = [[service for service in self._children if service not in last]]
        waves += [[service] for service in last if service in self._children]
        for wave in waves:
            for service in wave:
                self._children[service].process.terminate()
            for service in wave:
                self._wait(self._children[service])
        self._children.clear()

    def _spawn(self, service: str) -> _Child:
        log = (self.log_directory / f"{service}.jsonl").open("ab")
        command = [
            sys.executable,
            "-m",
            f"services.{service}",
            "--settings",
            str(self.settings_file),
            "--exit-with-parent",
        ]
        # A session of its own: Ctrl-C must reach the services through `stop`, in order, not all at once.
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True)
        return _Child(service, process, log, time.monotonic())

    def _note_death(self, child: _Child, status: int, now_s: float) -> None:
        child.log.close()
        if status == BAD_SETTINGS_STATUS:
            raise ServiceError(self._last_words(child.service))
        self.incidents.append(Incident(child.service, now_s, status))
        if now_s - child.started_s >= SETTLED_S:
            child.restarts_in_a_row = 0
        pause_s = BACK_OFF_S[min(child.restarts_in_a_row, len(BACK_OFF_S) - 1)]
        child.restarts_in_a_row += 1
        child.restart_at_s = now_s + pause_s

    def _last_words(self, service: str) -> str:
        path = self.log_directory / f"{service}.jsonl"
        lines = path.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        return lines[-1].removeprefix("alight ") if lines else f"{service} could not start; it left no word in {path}"

    def _wait(self, child: _Child) -> None:
        try:
            child.process.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            child.process.kill()
            child.process.wait()
        child.log.close()
