"""A process that publishes made-up frames, truths and vehicle states, each numbered, and says at its end how long the bus held it up.

`python tests/system/traffic.py --connect tcp/127.0.0.1:7447 [--listen ENDPOINT] [--client] [--rate 60]`, until SIGTERM or the end of its input.
"""

import argparse
import json
import sys
import threading
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from alight.runtime.bus import Bus
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.frame import FrameHeader
from schemas.message import GlobalPosition, Message
from schemas.settings.bus import BusSettings
from schemas.topics import Topic
from schemas.truth import GroundTruth
from schemas.vehicle import VehicleState
from schemas.wire import encode

WIDTH_PX, HEIGHT_PX = 640, 480
HOME = GlobalPosition(latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=500.0, ellipsoidal_height_m=547.0)
LEVEL, STILL = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)


class Traffic:
    """Publishes at a rate and measures each publication."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        noise = np.random.default_rng(0).integers(0, 256, (HEIGHT_PX, WIDTH_PX), np.uint8)
        self._pixels = noise.tobytes()
        self.number = 0
        self.longest_ms = 0.0

    def step(self) -> None:
        """One of each kind; `number` counts them, north of the pad in metres for the truth."""
        at_ns, number = time.time_ns(), self.number
        frame = FrameHeader(
            captured_at_ns=at_ns, sequence=number, width_px=WIDTH_PX, height_px=HEIGHT_PX, source="traffic"
        )
        self._publish(topics.FRAME, "camera", frame, self._pixels)
        self._publish(topics.GROUND_TRUTH, "simulator", truth(at_ns, number))
        state = VehicleState(
            at_ns=at_ns, position=HOME, velocity_ned_mps=STILL, q_ned_body=LEVEL, angular_velocity_body_rps=STILL
        )
        self._publish(topics.VEHICLE_STATE, "commander", state)
        if number % 60 == 0:
            self._publish(topics.CALIBRATION, "camera", calibration(at_ns))
        self.number += 1

    def _publish(self, topic: Topic[Message], service: str, message: Message, pixels: bytes | None = None) -> None:
        began_s = time.perf_counter()
        self._bus.publish(topic, service, encode(topic, message, pixels))
        self.longest_ms = max(self.longest_ms, 1e3 * (time.perf_counter() - began_s))


def truth(at_ns: int, number: int) -> GroundTruth:
    """A truth that carries its number."""
    return GroundTruth(
        at_ns=at_ns, vehicle_position=HOME, velocity_ned_mps=STILL, q_ned_body=LEVEL, angular_velocity_body_rps=STILL,
        pad_position=HOME, pad_azimuth_rad=0.0, vehicle_from_pad_ned_m=(float(number), 0.0, -5.0), touching_ground=False,
    )  # fmt: skip


def calibration(at_ns: int) -> CameraCalibration:
    """Any."""
    return CameraCalibration(
        at_ns=at_ns, width_px=WIDTH_PX, height_px=HEIGHT_PX, fx_px=293.0, fy_px=293.0, cx_px=319.5, cy_px=239.5
    )


def main() -> None:
    """Publish until the input ends."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--connect", default="")
    parser.add_argument("--listen", default="")
    parser.add_argument("--client", action="store_true")
    parser.add_argument("--rate", type=float, default=60.0)
    arguments = parser.parse_args()
    settings = BusSettings(
        mode="client" if arguments.client else "peer",
        connect=(arguments.connect,) if arguments.connect else (),
        listen=(arguments.listen,) if arguments.listen else (),
    )
    bus, ended = Bus("v1", settings), threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    traffic, due_s = Traffic(bus), time.monotonic()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    while not ended.wait(max(0.0, due_s - time.monotonic())):
        traffic.step()
        due_s = max(due_s + 1.0 / arguments.rate, time.monotonic() - 0.1)
    bus.close()
    sys.stdout.write(json.dumps({"published": traffic.number, "longest_ms": traffic.longest_ms}) + "\n")


if __name__ == "__main__":
    main()
