"""Names inside a flight's file, for who writes it and for who reads it."""

from pathlib import Path

LIBRARY = "alight"
"""What the head of every file of ours names as its maker."""
PROVENANCE = "alight"
"""Name of the metadata record that says which versions, vehicle and seed made the recording."""
HOST = "host"
"""Name of the metadata records with the host's name and clocks, at the beginning and the end of a part; none in lockstep."""
BEGINNING = "beginning"
"""Name of the metadata record that says where a part stands among the others and what was lost before it."""
ENDING = "ending"
"""Name of the metadata record that says why a part ends and what is missing in it; a part without one was cut short."""
REPAIR = "repair"
"""Name of the metadata record that a mended file carries: what could not be saved."""
SETTINGS_ATTACHMENT = "settings.json"
"""Name of the attachment with all settings."""
PAD_ATTACHMENT = "pad.json"
"""Name of the attachment with the pad's settings."""
CORRECTION_ATTACHMENT = "correction.json"
"""Name of the attachment with the correction of the systematic error that the geolocator applies."""
CALIBRATION_ATTACHMENT = "calibration.json"
"""Name of the attachment with the camera's calibration, as the camera published it."""
IMAGE = "image"
"""Last part of the key of a frame's picture, below the key of its header."""
TOPIC = "topic"
"""Key in a channel's metadata: the topic's name in the table of topics."""
WIRE_ENCODING = "wire_encoding"
"""Key in a channel's metadata: the message and the schema version as the wire names them."""


def part(path: Path, number: int) -> Path:
    """File of a recording that was begun `number` times: `flight.mcap`, `flight_2.mcap`, `flight_3.mcap` ..."""
    return path if number == 1 else path.with_stem(f"{path.stem}_{number}")
