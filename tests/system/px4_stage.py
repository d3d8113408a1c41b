"""A real PX4 (SITL) and the commander on the wall clock: one process, one UDP socket, the other nodes beside it."""

import contextlib
import os
import select
import signal
import socket
import subprocess
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from alight.runtime.clock import NS_PER_S, WallClock
from alight.runtime.host import NodeHost
from alight.runtime.node import Node, Output, Publication
from schemas.settings import Settings


class Px4:
    """One PX4 SITL instance, started by the script that ALIGHT_PX4_RUN names: `SCRIPT INSTANCE FOLDER`, in the foreground."""

    def __init__(self, script: str, instance: int, folder: Path, **environment: str) -> None:
        self.onboard_port = 14540 + instance
        self.command_port = 14580 + instance
        self._process = subprocess.Popen(
            [script, str(instance), str(folder)],
            env={**os.environ, **environment},
            start_new_session=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def close(self) -> None:
        self._process.send_signal(signal.SIGTERM)
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


class WallStage:
    """Runs nodes on the wall clock; the commander's `vehicle` port is a UDP socket."""

    def __init__(self, settings: Settings, nodes: Sequence[Node], local_port: int) -> None:
        self._settings = settings
        self._clock = WallClock()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", local_port))
        self._socket.setblocking(False)
        self._peer: tuple[str, int] | None = None
        self._hosts: list[NodeHost] = []
        self._ticks: dict[str, int] = {}
        for node in nodes:
            self.add(node)

    def now_ns(self) -> int:
        return self._clock.now_ns()

    def add(self, node: Node) -> None:
        """Add a node, or put it in the place of the one of the same service."""
        self.remove(node.service)
        self._hosts.append(NodeHost(node, self._settings.bus, self._clock, pid=0, strict=True))
        self._ticks[node.service] = 0

    def remove(self, service: str) -> None:
        """Take a node away without a word, as SIGKILL would."""
        self._hosts = [host for host in self._hosts if host.node.service != service]

    def run(self, for_s: float, finished: Callable[[], bool] = lambda: False) -> bool:
        """Run for a while, or until `finished` says so; whether it did."""
        until_ns = self.now_ns() + round(for_s * NS_PER_S)
        while self.now_ns() < until_ns:
            select.select([self._socket], [], [], 0.002)
            self._receive()
            self._tick()
            if finished():
                return True
        return False

    def send(self, data: bytes) -> None:
        """Send what somebody else on the link would."""
        assert self._peer is not None
        self._socket.sendto(data, self._peer)

    def close(self) -> None:
        self._socket.close()

    def _receive(self) -> None:
        with contextlib.suppress(BlockingIOError):
            for _ in range(200):
                data, self._peer = self._socket.recvfrom(65536)
                for host in self._hosts:
                    if "vehicle" in host.node.ports:
                        self._carry(host, host.take_bytes("vehicle", data, self.now_ns()), None)

    def _tick(self) -> None:
        for host in list(self._hosts):
            period_ns = host.node.tick_period_ns
            if period_ns is not None and self.now_ns() - self._ticks[host.node.service] >= period_ns:
                self._ticks[host.node.service] = self.now_ns()
                self._carry(host, host.tick(self.now_ns()), None)

    def _carry(self, host: NodeHost, outputs: Iterable[Output], cause: object) -> None:
        for output in outputs:
            if not isinstance(output, Publication):
                if self._peer is not None:
                    self._socket.sendto(output.data, self._peer)
                continue
            message = host.stamped(output, cause, self.now_ns())  # type: ignore[arg-type]
            for reader in self._hosts:
                if output.topic in reader.node.subscriptions:
                    arrival = reader.admit(output.topic, message, None, self.now_ns())
                    if arrival is not None:
                        self._carry(reader, reader.handle(arrival), arrival)
