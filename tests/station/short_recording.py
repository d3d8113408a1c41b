"""The first two seconds of a made-up flight as a recording: every topic, some pictures, several chunks."""

from pathlib import Path

from synthetic_flight import START_NS, Flight

from alight.runtime.clock import NS_PER_S
from alight.runtime.node import Arrival
from schemas.settings import Settings
from services.recorder.flight_file import FlightFile
from services.recorder.node import Recorder


def short_recording(directory: Path) -> Path:
    """Write it; returns the file."""
    settings = Settings.model_validate({"seed": 7, "recorder": {"directory": directory}})
    node = Recorder(settings, FlightFile(settings))
    said = [one for one in Flight(paint_every=20).spoken() if one.at_ns < START_NS + 2 * NS_PER_S]
    for number, one in enumerate(said):
        node.on_message(Arrival(one.topic, one.message, one.at_ns, one.at_ns, one.pixels))
        if number % 100 == 0:
            node.on_tick(one.at_ns)
    node.close()
    return directory / "flight.mcap"
