"""A cell as its owner sees it: give it a task, get a row, whatever happens inside."""

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from typing import IO

from station.campaign.flight_task import FlightTask
from station.campaign.row import CRASHED, TIMED_OUT, Row, failed_row

_START_LIMIT_S = 120.0
_STARTS = 3
"""How often a cell is started before there can be none: it may be ended from outside while it starts, too."""
_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""One flight, one core: more threads would wait for each other."""

_FROM_OUTSIDE = (signal.SIGKILL, signal.SIGTERM, signal.SIGHUP)


class CellError(RuntimeError):
    """No cell can be started here: one line with the reason."""


class CellProcess:
    """Owns one cell at a time; a cell that died or hung is replaced. For one thread, but `stop` for any."""

    def __init__(self) -> None:
        self.software = ""
        """Which software the running cell is."""
        self._process: subprocess.Popen[bytes] | None = None
        self._errors: IO[bytes] | None = None
        self._unread = b""
        self._stopped = False

    def fly(self, task: FlightTask, time_limit_s: float) -> Row:
        """One flight; a row in any case.

        A cell that somebody ended from outside (the kernel for want of memory, an operator) says nothing about its flight,
        which is then flown a second time; whoever is ended twice has crashed.

        Raises:
            CellError: If no cell starts, which says nothing about the flight either, or after `stop`.
        """
        row, ended_by = self._try(task, time_limit_s)
        if ended_by in _FROM_OUTSIDE:
            row, _ = self._try(task, time_limit_s)
        return row

    def stop(self) -> None:
        """End the cell in the middle of its flight, and let no other one start."""
        self._stopped = True
        if (process := self._process) is not None:
            process.kill()

    def close(self) -> None:
        """End the cell."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            for pipe in (self._process.stdin, self._process.stdout):
                assert pipe is not None
                with contextlib.suppress(BrokenPipeError):
                    pipe.close()
        if self._errors is not None:
            self._errors.close()
        self._process = self._errors = None

    def _try(self, task: FlightTask, time_limit_s: float) -> tuple[Row, int]:
        """A row, and the signal that ended the cell, 0 for none."""
        process = self._running()
        assert process.stdin is not None
        try:
            process.stdin.write(task.model_dump_json().encode() + b"\n")
            process.stdin.flush()
            line = self._line(time_limit_s)
        except BrokenPipeError:
            line = b""
        except TimeoutError:
            self.close()
            return failed_row(task, TIMED_OUT, f"hung: no end after {time_limit_s:g} s of work"), 0
        if line:
            row: Row = json.loads(line)
            return row, 0
        reason, status = self._last_words(), process.wait()
        self.close()
        if self._stopped:
            raise CellError("stopped")
        return failed_row(task, CRASHED, reason), max(-status, 0)

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is not None and self._process.poll() is None:
            return self._process
        for _ in range(_STARTS):
            self.close()
            if self._stopped:
                raise CellError("stopped")
            self._process = self._started()
            with contextlib.suppress(TimeoutError):
                if first := self._line(_START_LIMIT_S):
                    self.software = json.loads(first)["software"]
                    return self._process
        reason = self._last_words()
        self.close()
        raise CellError(f"no flight can be flown here: {reason}")

    def _started(self) -> subprocess.Popen[bytes]:
        self._unread = b""
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the cell
        return subprocess.Popen(
            [sys.executable, "-m", "station.campaign.cell"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            env={**os.environ, **_ONE_THREAD},
        )

    def _line(self, limit_s: float) -> bytes:
        """The next reply; empty if the cell died.

        Raises:
            TimeoutError: If neither comes in time.
        """
        assert self._process is not None and self._process.stdout is not None
        output, deadline_s = self._process.stdout.fileno(), time.monotonic() + limit_s
        while b"\n" not in self._unread:
            left_s = deadline_s - time.monotonic()
            if left_s <= 0.0 or not select.select([output], [], [], left_s)[0]:
                raise TimeoutError
            more = os.read(output, 65536)
            if not more:
                return b""
            self._unread += more
        line, _, self._unread = self._unread.partition(b"\n")
        return line

    def _last_words(self) -> str:
        assert self._process is not None and self._errors is not None
        try:
            status = self._process.wait(10.0)
        except subprocess.TimeoutExpired:
            return f"did not start within {_START_LIMIT_S:g} s"
        self._errors.seek(0)
        said = [line for line in self._errors.read().decode(errors="replace").splitlines() if line.strip()]
        if status < 0:
            return f"its process died of {_signal_name(-status)}"
        return f"its process ended with status {status}: {said[-1].strip() if said else 'no word'}"


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
