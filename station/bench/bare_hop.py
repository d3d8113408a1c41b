"""What a hop costs with nothing of ours in it: bytes from one process to another over Zenoh, as often as a camera's frames.

`python -m station.bench.bare_hop send|receive ENDPOINT MESSAGES` is one of the two processes.
"""

import json
import subprocess
import sys
import threading
import time
from typing import Any

import zenoh

from alight.runtime.bus import Bus
from alight.runtime.priority import prioritise
from alight.runtime.wakefulness import kept_awake
from schemas.settings.bus import BusSettings
from station.bench.free_port import free_port
from station.metrics.latency import Percentiles, percentiles

MESSAGES = 200
PERIOD_S = 1.0 / 30.0
"""In such a pause the processors forget, as they do between two frames."""
SIZE_BYTES = 2000
"""About that of a detection, a fix or an estimate."""

_KEY = "alight/bench/bare_hop"
_PATIENCE_S = 20.0


def bare_hop(messages: int = MESSAGES) -> Percentiles:
    """From just before the sending to the reader's first line, ms: processors awake and scheduled as in a flight.

    Raises:
        RuntimeError: If the messages do not arrive.
    """
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with kept_awake(wanted=True, real_time=True):
        command = [sys.executable, "-m", "station.bench.bare_hop"]
        with (
            subprocess.Popen([*command, "receive", endpoint, str(messages)], stdout=subprocess.PIPE) as receiver,
            subprocess.Popen([*command, "send", endpoint, str(messages)]),
        ):
            said, _ = receiver.communicate()
    times_ms: list[float] = json.loads(said or "[]")
    if len(times_ms) < messages:
        raise RuntimeError(f"{len(times_ms)} of {messages} messages arrived")
    return percentiles(times_ms)


def _send(endpoint: str, messages: int) -> None:
    bus = Bus("bench", BusSettings(connect=(endpoint,)))
    publisher: Any = bus.session.declare_publisher(_KEY)
    _wait_for_reader(publisher, there=True)
    rest = bytes(SIZE_BYTES - 8)
    for _ in range(messages):
        time.sleep(PERIOD_S)
        publisher.put(time.time_ns().to_bytes(8, "little") + rest)
    _wait_for_reader(publisher, there=False)  # it leaves when it has them all
    bus.close()


def _wait_for_reader(publisher: Any, *, there: bool) -> None:
    deadline_s = time.monotonic() + _PATIENCE_S
    while bool(publisher.matching_status.matching) is not there and time.monotonic() < deadline_s:
        time.sleep(0.05)


def _receive(endpoint: str, messages: int) -> None:
    bus = Bus("bench", BusSettings(connect=(), listen=(endpoint,)))
    times_ms: list[float] = []
    all_here = threading.Event()

    def on_sample(sample: zenoh.Sample) -> None:
        now_ns = time.time_ns()
        times_ms.append((now_ns - int.from_bytes(sample.payload.to_bytes()[:8], "little")) / 1e6)
        if len(times_ms) == messages:
            all_here.set()

    bus.session.declare_subscriber(_KEY, on_sample)
    all_here.wait(_PATIENCE_S + messages * 2.0 * PERIOD_S)
    print(json.dumps(times_ms))
    bus.close()


if __name__ == "__main__":
    prioritise("geolocator", real_time=True)
    {"send": _send, "receive": _receive}[sys.argv[1]](sys.argv[2], int(sys.argv[3]))
