"""A detector that shares no code with Alight: Zenoh, OpenCV, and what `alight schema export` wrote are all it knows.

It takes the place of `services.detector` on the bus: one detection for every frame it gets, with the marker or without.
"""

import argparse
import json
import logging
import os
import signal
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import zenoh
from contract import Contract, UnusableError
from marker import Lens, MarkerFinder, PadMarker

LOGGER = logging.getLogger("foreign_detector")

SERVICE = "detector"
"""The service whose place it takes: the others know it by this name, in hops and in health."""
HEALTH_PERIOD_S = 1.0


class Newest:
    """A mailbox for one sample: a frame that nobody took up yet is replaced by the next, so that delay never piles up."""

    def __init__(self) -> None:
        """Begin empty."""
        self._filled = threading.Condition()
        self._held: tuple[zenoh.Sample, int] | None = None

    def put(self, sample: zenoh.Sample) -> None:
        """Called by Zenoh; returns at once."""
        with self._filled:
            self._held = (sample, time.time_ns())
            self._filled.notify()

    def take(self, timeout_s: float) -> tuple[zenoh.Sample, int] | None:
        """The newest sample and when it arrived, UTC ns; None if none came in time."""
        with self._filled:
            self._filled.wait_for(lambda: self._held is not None, timeout_s)
            held, self._held = self._held, None
            return held


def grey_picture(header: dict[str, Any], pixels: bytes) -> np.ndarray:
    """The raw bytes as a picture in grey levels.

    Raises:
        UnusableError: If they are more or fewer than the header says.
    """
    channels = {"mono8": 1, "bgr8": 3}[header.get("pixel_format", "mono8")]
    shape = (header["height_px"], header["width_px"], channels)
    if len(pixels) != shape[0] * shape[1] * channels:
        raise UnusableError(f"camera/frame: {len(pixels)} bytes for a picture of {shape}")
    picture = np.frombuffer(pixels, np.uint8).reshape(shape)
    return picture[:, :, 0] if channels == 1 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)


@dataclass
class ForeignDetector:
    """Frames in, detections out."""

    contract: Contract
    finder: MarkerFinder
    lens: Lens | None = None
    newest_capture_ns: int = -1
    complaint: str = ""
    counters: dict[str, int] = field(default_factory=lambda: {"frames": 0, "frames_with_markers": 0, "unusable": 0})

    def take_calibration(self, sample: zenoh.Sample) -> None:
        """Called by Zenoh about once a second."""
        try:
            self.lens = Lens.of(self.contract.read("camera/calibration", sample))
        except UnusableError as error:
            self.complain(str(error))

    def detection(self, sample: zenoh.Sample, received_at_ns: int) -> bytes | None:
        """The answer to one frame; None if it is unusable, or no newer than the one before."""
        handled_at_ns = time.time_ns()
        try:
            header = self.contract.read("camera/frame", sample)
            if header["captured_at_ns"] <= self.newest_capture_ns:
                return None
            ahead_s = (header["captured_at_ns"] - handled_at_ns) * 1e-9
            if ahead_s > self.contract.index["max_clock_skew_s"]:
                raise UnusableError(f"camera/frame: captured {ahead_s:.3f} s from now: check the clocks")
            picture = grey_picture(header, sample.payload.to_bytes())
            self.newest_capture_ns = header["captured_at_ns"]
            markers = self.markers(picture)
            hop = {"service": SERVICE, "received_at_ns": received_at_ns, "handled_at_ns": handled_at_ns}
            message = {
                "captured_at_ns": header["captured_at_ns"],
                "hops": [*header.get("hops", []), {**hop, "published_at_ns": time.time_ns()}],
                "frame_sequence": header["sequence"],
                "detector": "foreign",
                "markers": markers,
            }
            return self.contract.write("detector/detection", message)
        except UnusableError as error:
            self.complain(str(error))
            return None

    def markers(self, picture: np.ndarray) -> list[dict[str, Any]]:
        """What is in the picture; nothing without a calibration that fits it, for then no pose can be had."""
        self.counters["frames"] += 1
        if self.lens is None or self.lens.size_px != picture.shape[::-1]:
            self.complaint = "no camera calibration for frames of this size has come yet"
            return []
        self.complaint = ""
        try:
            markers = self.finder.find(picture, self.lens)
        except cv2.error as error:  # a shape that is no square after all; the next frame has another
            self.complain(f"OpenCV: {error}")
            return []
        self.counters["frames_with_markers"] += bool(markers)
        return markers

    def complain(self, complaint: str) -> None:
        """Say what cannot be used, each thing once in a row."""
        self.counters["unusable"] += 1
        if complaint != self.complaint:
            LOGGER.warning(complaint)
        self.complaint = complaint

    def health(self, uptime_s: float) -> bytes:
        """What `alight status`, the recording and the report show of this process."""
        message = {
            "at_ns": time.time_ns(),
            "service": SERVICE,
            "pid": os.getpid(),
            "uptime_s": uptime_s,
            "inputs": [],
            "outputs": [],
            "counters": self.counters,
            "complaints": [self.complaint[:500]] if self.complaint else [],
        }
        return self.contract.write("health", message)


def zenoh_configuration(contract: Contract, connect: str | None, listen: str | None) -> zenoh.Config:
    """The bus's own configuration, with this process's addresses."""
    config = zenoh.Config()
    values = dict(contract.index["zenoh_configuration"])
    for key, endpoint in (("connect/endpoints", connect), ("listen/endpoints", listen)):
        if endpoint is not None:
            values[key] = [endpoint]
    for key, value in values.items():
        config.insert_json5(key, json.dumps(value))
    return config


def run(session: zenoh.Session, contract: Contract, detector: ForeignDetector) -> None:
    """Answer frames until the process is told to stop."""
    frames = Newest()
    alive_key = contract.key(contract.index["alive_key_expression"])
    _held = (
        session.declare_subscriber(contract.topic_key("camera/calibration"), detector.take_calibration),
        session.declare_subscriber(contract.topic_key("camera/frame"), frames.put),
        session.liveliness().declare_token(alive_key),
    )
    detections, health = (
        session.declare_publisher(
            contract.topic_key(topic),
            encoding=zenoh.Encoding(contract.encoding(topic)),
            congestion_control=zenoh.CongestionControl.BLOCK,  # the delivery `state`: nothing may be dropped
        )
        for topic in ("detector/detection", "health")
    )
    began_s = told_s = time.monotonic()
    LOGGER.info("waiting for frames, alive at %s", alive_key)
    while True:
        taken = frames.take(HEALTH_PERIOD_S)
        answer = detector.detection(*taken) if taken is not None else None
        if answer is not None:
            detections.put(answer)
        now_s = time.monotonic()
        if now_s - told_s >= HEALTH_PERIOD_S:
            told_s = now_s
            health.put(detector.health(now_s - began_s))


def main() -> None:
    """Read the command line and detect until SIGINT or SIGTERM."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("contract", type=Path, help="folder that `alight schema export` wrote")
    parser.add_argument("--vehicle", help="the vehicle's name on the bus (default: the export's)")
    parser.add_argument("--connect", help="endpoint of the station, such as tcp/192.168.1.5:7447")
    parser.add_argument("--listen", help="endpoint at which this process may be reached, such as tcp/192.168.1.9:0")
    parser.add_argument("--family", default="5x5_1000", help="as `pad.family` of the flight's settings")
    parser.add_argument("--id", type=int, default=68, help="as `pad.id`")
    parser.add_argument("--side", type=float, default=1.0, metavar="M", help="as `pad.side_m`")
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    contract = Contract(arguments.contract, SERVICE, arguments.vehicle)
    finder = MarkerFinder(PadMarker(arguments.family, arguments.id, arguments.side))
    config = zenoh_configuration(contract, arguments.connect, arguments.listen)
    try:
        with zenoh.open(config) as session:
            run(session, contract, ForeignDetector(contract, finder))
    except KeyboardInterrupt:
        LOGGER.info("stopped")


if __name__ == "__main__":
    main()
