"""Names inside a flight's file, for who writes it and for who reads it."""

from pathlib import Path

PROVENANCE = "alight"
"""Name of the metadata record that says which versions, vehicle and seed made the recording."""
SETTINGS_ATTACHMENT = "settings.json"
"""Name of the attachment with all settings."""
IMAGE = "image"
"""Last part of the key of a frame's picture, below the key of its header."""
TOPIC = "topic"
"""Key in a channel's metadata: the topic's name in the table of topics."""
WIRE_ENCODING = "wire_encoding"
"""Key in a channel's metadata: the message and the schema version as the wire names them."""


def part(path: Path, number: int) -> Path:
    """File of a recording that was begun `number` times: `flight.mcap`, `flight_2.mcap`, `flight_3.mcap` ..."""
    return path if number == 1 else path.with_stem(f"{path.stem}_{number}")
