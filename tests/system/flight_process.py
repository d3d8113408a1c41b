"""`alight fly` as a process, on ports of its own, for the tests that look at a whole flight from outside."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
FLIGHT_TIMEOUT_S = 240.0
IN_THE_AIR = ("--set", "simulator.airborne={north_m=10.0, east_m=10.0, down_m=-20.0}")
"""Begins where the landing begins, without takeoff and transit."""


def free_port(kind: int = socket.SOCK_STREAM) -> int:
    """A port of this host's loopback that is free now."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class FlightProcess:
    """One `alight fly`; its lines are read as they come."""

    def __init__(self, out: Path, options: Sequence[str] = (), prefix: Sequence[str] = ()) -> None:
        self.out = out
        self.bus_port = free_port()
        autopilot, companion = free_port(socket.SOCK_DGRAM), free_port(socket.SOCK_DGRAM)
        self.options = [
            "--out", str(out),
            "--set", f'bus.connect=["tcp/127.0.0.1:{self.bus_port}"]',
            "--set", f"simulator.url=udp://127.0.0.1:{autopilot}?to=127.0.0.1:{companion}",
            "--set", f"commander.vehicle_url=udpin://127.0.0.1:{companion}",
            *options,
        ]  # fmt: skip
        self.lines: list[str] = []
        command = [*prefix, sys.executable, "-u", "-m", "station", "fly", *self.options]
        self.process = subprocess.Popen(
            command, cwd=REPOSITORY, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def wait(self, timeout_s: float = FLIGHT_TIMEOUT_S) -> int:
        """Exit status."""
        status = self.process.wait(timeout_s)
        self._reader.join(5.0)
        return status

    def wait_for_line(self, condition: Callable[[str], bool], timeout_s: float = 120.0) -> str:
        """The first line, past or to come, of which `condition` holds."""
        deadline_s = time.monotonic() + timeout_s
        seen = 0
        while time.monotonic() < deadline_s:
            for line in self.lines[seen:]:
                seen += 1
                if condition(line):
                    return line
            assert self.process.poll() is None or seen < len(self.lines), f"the flight ended:\n{self.output}"
            time.sleep(0.02)
        raise AssertionError(f"no such line:\n{self.output}")

    @property
    def output(self) -> str:
        """All it said."""
        return "\n".join(self.lines)

    def pid_of(self, service: str) -> int:
        """Process id of one of its services, found among its children."""
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        for child in children:
            with contextlib.suppress(OSError):
                words = Path(f"/proc/{child}/cmdline").read_bytes().decode().split("\0")
                if f"services.{service}" in words:
                    return int(child)
        raise AssertionError(f"{service} does not run:\n{self.output}")

    def kill_service(self, service: str) -> None:
        """End one of its services as the kernel would."""
        os.kill(self.pid_of(service), signal.SIGKILL)

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line.rstrip("\n"))


@contextlib.contextmanager
def flight(out: Path, options: Sequence[str] = ()) -> Iterator[FlightProcess]:
    """A flight that is ended in any case."""
    running = FlightProcess(out, options)
    try:
        yield running
    finally:
        if running.process.poll() is None:
            running.process.send_signal(signal.SIGINT)
            try:
                running.process.wait(20.0)
            except subprocess.TimeoutExpired:
                running.process.kill()
