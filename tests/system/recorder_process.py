"""A recorder as a process of its own, and made-up traffic for it to record."""

import contextlib
import json
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from flight_process import REPOSITORY, free_port


class TrafficProcess:
    """`traffic.py`; where others find it, and what it says at its end."""

    def __init__(self, rate_hz: float = 60.0, options: Sequence[str] = (), prefix: Sequence[str] = ()) -> None:
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        options = options or ("--listen", self.endpoint)
        script = str(REPOSITORY / "tests" / "system" / "traffic.py")
        self._process = subprocess.Popen(
            [*prefix, sys.executable, script, "--rate", str(rate_hz), *options],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "ready\n"

    def end(self) -> dict[str, Any]:
        """End it; `published` and `longest_ms`."""
        said, _ = self._process.communicate(timeout=20.0)
        return dict(json.loads(said.splitlines()[-1]))  # Zenoh may have complained before

    def kill(self) -> None:
        """End it in any case."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()


@contextlib.contextmanager
def traffic(rate_hz: float = 60.0, options: Sequence[str] = (), prefix: Sequence[str] = ()) -> Iterator[TrafficProcess]:
    """Traffic that is ended in any case."""
    running = TrafficProcess(rate_hz, options, prefix)
    try:
        yield running
    finally:
        running.kill()


def recorder_command(directory: Path, connect: str, settings: Sequence[str] = ()) -> list[str]:
    """The words that start a recorder into a folder."""
    command = [sys.executable, "-m", "services.recorder", "--set", f"recorder.directory={directory}"]
    for assignment in (f'bus.connect=["{connect}"]', *settings):
        command += ["--set", assignment]
    return command


@contextlib.contextmanager
def recorder(
    directory: Path, connect: str, settings: Sequence[str] = (), prefix: Sequence[str] = ()
) -> Iterator[subprocess.Popen[bytes]]:
    """A recorder that is ended in order, if it still runs."""
    command = [*prefix, *recorder_command(directory, connect, settings)]
    with (directory.parent / f"{directory.name}.log").open("wb") as log:
        process = subprocess.Popen(command, cwd=REPOSITORY, stdout=log, stderr=subprocess.STDOUT)
        try:
            yield process
        finally:
            if process.poll() is None:
                process.terminate()
                process.wait(20.0)


def wait_for_size(path: Path, size_bytes: int, timeout_s: float = 60.0) -> None:
    """Wait until a file is that long."""
    until_s = time.monotonic() + timeout_s
    while not path.exists() or path.stat().st_size < size_bytes:
        assert time.monotonic() < until_s, f"{path} did not grow to {size_bytes} bytes"
        time.sleep(0.02)
