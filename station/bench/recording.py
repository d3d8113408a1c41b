"""What recording costs the flight: live flights with a camera of 60 frames a second, without and with the recorder, by turns.

The ground is plain, since drawing 60 textured pictures a second leaves too little of two slow cores. How much was left of the whole
machine is printed: where it is nothing, the figures tell of the machine and not of the recorder.
"""

import os
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from alight.runtime.bus import Bus
from schemas import topics
from schemas.health import Health
from schemas.setpoint import Setpoint
from schemas.settings import Settings
from schemas.settings.bus import BusSettings
from station.bench.free_port import free_port
from station.bench.table import print_table
from station.flight_record import read_flight
from station.mcap_parts import PartsReader
from station.metrics.latency import latency_budget
from station.recording.inventory import take_inventory

FRAME_RATE_HZ = 60
ROUNDS = 2
ARMS = {"without recorder": None, "frames jpeg": "jpeg", "frames raw": "raw"}
IN_THE_AIR = "simulator.airborne={north_m=10.0, east_m=10.0, down_m=-20.0}"
_POLL_S = 0.2


@dataclass
class _Arm:
    """All flights of one kind."""

    setpoints: list[Setpoint] = field(default_factory=list)
    idle_s: float = 0.0
    cores_s: float = 0.0
    frames: int = 0
    missing: int = 0
    lost: int = 0
    lag_max_ms: float = 0.0
    busy_s: float = 0.0
    flown_s: float = 0.0
    megabytes: float = 0.0


def bench_recording() -> None:
    """Fly each kind in turn, forwards and backwards, and print capture to setpoint side by side."""
    arms = {name: _Arm() for name in ARMS}
    for number in range(ROUNDS):
        for name in list(ARMS) if number % 2 == 0 else reversed(ARMS):
            with tempfile.TemporaryDirectory() as folder:
                _Flight(Path(folder) / "flight", ARMS[name]).fly(arms[name])
    rows = [_row(name, arm) for name, arm in arms.items()]
    baseline_ms = _p99_ms(arms["without recorder"])
    rows = [
        (*row[:5], f"{_p99_ms(arm) / baseline_ms:.2f}", *row[5:]) for row, arm in zip(rows, arms.values(), strict=True)
    ]
    head = (
        "flights", "setpoints", "idle, %", "p50, ms", "p99, ms", "p99 / without", "frames", "not recorded", "lost", "lag max, ms",
        "one core, %", "MB/s",
    )  # fmt: skip
    print_table(
        f"Capture to setpoint with 640x480 at {FRAME_RATE_HZ} Hz, {ROUNDS} live flights of each kind by turns",
        head,
        rows,
    )


class _Flight:
    """One flight on a bus of its own, listened to from outside, so that all kinds are measured alike."""

    def __init__(self, out: Path, frames: str | None) -> None:
        self._out = out
        self._frames = frames
        self._endpoint = f"tcp/127.0.0.1:{free_port(socket.SOCK_STREAM)}"
        self._heard: list[bytes] = []

    def fly(self, arm: _Arm) -> None:
        """Fly it and add what was measured."""
        began_s, (idle_s, cores_s) = time.monotonic(), _machine_s()
        flying = subprocess.Popen(self._command(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        bus = Bus(Settings().vehicle, BusSettings(connect=(self._endpoint,)))
        try:
            bus.subscribe(topics.SETPOINT, lambda _, payload, *__: self._heard.append(payload))
            busy_s = self._follow(flying)
        finally:
            bus.close()
            if flying.poll() is None:
                flying.terminate()
                flying.wait()
        idle_after_s, cores_after_s = _machine_s()
        arm.idle_s += idle_after_s - idle_s
        arm.cores_s += cores_after_s - cores_s
        arm.setpoints += [Setpoint.model_validate_json(payload) for payload in self._heard]
        if self._frames is not None:
            arm.busy_s += busy_s
            arm.flown_s += time.monotonic() - began_s
            self._look_at_recording(arm)

    def _command(self) -> list[str]:
        autopilot, companion = (free_port(socket.SOCK_DGRAM) for _ in range(2))
        wanted = [
            f'bus.connect=["{self._endpoint}"]',
            f"simulator.url=udp://127.0.0.1:{autopilot}?to=127.0.0.1:{companion}",
            f"commander.vehicle_url=udpin://127.0.0.1:{companion}",
            f"camera.rate_hz={FRAME_RATE_HZ}",
            'camera.simulated.ground="plain"',
            IN_THE_AIR,
        ]
        command = [sys.executable, "-m", "station", "fly", "--out", str(self._out)]
        if self._frames is None:
            command += ["--without", "recorder"]
        else:
            wanted.append(f'recorder.frames="{self._frames}"')
        return [*command, *(word for assignment in wanted for word in ("--set", assignment))]

    def _follow(self, flying: "subprocess.Popen[bytes]") -> float:
        """Wait for the end; the processor time that the recorder took, seconds."""
        busy_s = 0.0
        while flying.poll() is None:
            busy_s = max(busy_s, _busy_s(flying.pid, "services.recorder"))
            time.sleep(_POLL_S)
        return busy_s

    def _look_at_recording(self, arm: _Arm) -> None:
        file = self._out / "flight.mcap"
        frames = take_inventory(PartsReader(file)).channels[topics.FRAME.name]
        own = [health for health in read_flight(file).messages(topics.HEALTH) if health.service == "recorder"]
        arm.frames += frames.messages
        arm.missing += frames.not_written + (frames.not_received or 0)
        arm.lost += _last(own, "lost")
        arm.lag_max_ms = max(arm.lag_max_ms, _last(own, "lag_max_us") / 1e3)
        arm.megabytes += file.stat().st_size / 1e6


def _row(name: str, arm: _Arm) -> tuple[str, ...]:
    budget = latency_budget(arm.setpoints)
    if budget is None:
        return (name, "0", *[""] * 9)
    idle = f"{100 * arm.idle_s / arm.cores_s:.0f}"
    measured = (name, str(budget.setpoints), idle, f"{budget.total.p50_ms:.2f}", f"{budget.total.p99_ms:.2f}")
    if arm.flown_s == 0.0:
        return (*measured, *["-"] * 6)
    cost = (f"{100 * arm.busy_s / arm.flown_s:.0f}", f"{arm.megabytes / arm.flown_s:.1f}")
    return (*measured, str(arm.frames), str(arm.missing), str(arm.lost), f"{arm.lag_max_ms:.1f}", *cost)


def _p99_ms(arm: _Arm) -> float:
    budget = latency_budget(arm.setpoints)
    return budget.total.p99_ms if budget else float("nan")


def _last(healths: list[Health], counter: str) -> int:
    return healths[-1].counters[counter] if healths else 0


def _busy_s(parent: int, module: str) -> float:
    """Processor time that a child of a process has taken, seconds; 0 if there is none."""
    with suppress(OSError, IndexError):
        for child in Path(f"/proc/{parent}/task/{parent}/children").read_text().split():
            if module in Path(f"/proc/{child}/cmdline").read_text():
                fields = Path(f"/proc/{child}/stat").read_text().rsplit(")", 1)[1].split()
                return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return 0.0


def _machine_s() -> tuple[float, float]:
    """Time that the machine's cores have been idle, and all their time, seconds since it started."""
    with suppress(OSError):
        fields = [int(word) for word in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:]]
        ticks = os.sysconf("SC_CLK_TCK")
        return (fields[3] + fields[4]) / ticks, sum(fields) / ticks
    return float("nan"), float("nan")
