"""`alight schema export DIR`: the contract as JSON Schemas, so that a service can be written in any language."""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from alight.runtime.bus import alive_key, configuration_values
from schemas import topics
from schemas.message import SCHEMA_VERSION
from schemas.settings import Settings
from schemas.topics import Topic
from schemas.wire import MAX_JSON_BYTES, encoding_of

DIALECT = "https://json-schema.org/draft/2020-12/schema"
STAMPS = ("at_ns", "sent_at_ns", "captured_at_ns")
"""The fields by which age and order on a topic may be judged (`Message.stamp_ns`): of those that a message has, the first."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe `alight schema export`."""
    parser.add_argument("directory", type=Path, metavar="DIR", help="folder to write into, made if it is missing")


def run(arguments: argparse.Namespace) -> int:
    """Carry out `alight schema export DIR`; returns the exit status."""
    if (arguments.directory / "__init__.py").exists():
        return _refuse(f"{arguments.directory} holds Python code: choose another folder, such as contract")
    try:
        written = export(arguments.directory)
    except OSError as error:
        return _refuse(f"{arguments.directory} cannot be written ({error.strerror}): choose another folder")
    print(f"{len(written)} files written to {arguments.directory}; begin with topics.json")
    return 0


def _refuse(reason: str) -> int:
    print(f"alight schema export: {reason}", file=sys.stderr)
    return 1


def export(directory: Path) -> list[Path]:
    """Write the schemas and the table.

    Raises:
        OSError: If the folder cannot be written.
    """
    directory.mkdir(parents=True, exist_ok=True)
    files = {schema_file(topic): schema_of(topic) for topic in topics.TOPICS}
    files["topics.json"] = topics_index()
    for name, content in files.items():
        (directory / name).write_text(json.dumps(content, indent=2) + "\n")
    return [directory / name for name in files]


def schema_file(topic: Topic[Any]) -> str:
    """Name of a topic's file, such as `geolocator.fix.schema.json`."""
    return f"{topic.name.replace('/', '.')}.schema.json"


def schema_of(topic: Topic[Any]) -> dict[str, Any]:
    """The JSON Schema of a topic's messages; every field's description gives its unit and frame."""
    return {"$schema": DIALECT, **topic.message.model_json_schema()}


def topics_index() -> dict[str, Any]:
    """The table of topics in JSON, with what is needed to speak on each of them."""
    defaults = Settings()
    return {
        "schema_version": SCHEMA_VERSION,
        "key_expressions": "Zenoh; {vehicle} is the vehicle's name, {service} the publishing service's",
        "default_vehicle": defaults.vehicle,
        "alive_key_expression": alive_key("{vehicle}", "{service}"),
        "zenoh_configuration": configuration_values(defaults.bus),
        "max_clock_skew_s": defaults.bus.max_clock_skew_s,
        "max_message_bytes": MAX_JSON_BYTES,
        "topics": [_row(topic) for topic in topics.TOPICS],
    }


def _row(topic: Topic[Any]) -> dict[str, Any]:
    return {
        "name": topic.name,
        "key_expression": topic.key("{vehicle}", "{service}"),
        "message": topic.message.__name__,
        "schema": schema_file(topic),
        "description": (topic.message.__doc__ or "").strip(),
        "encoding": encoding_of(topic),
        "payload": "raw pixels, row by row, as the message says" if topic.has_pixels else "the message as JSON",
        "attachment": "the message as JSON" if topic.has_pixels else None,
        "stamp": next(name for name in STAMPS if name in topic.message.model_fields),
        "delivery": topic.delivery.value,
        "nominal_hz": topic.nominal_hz,
        "stale_after_s": topic.stale_after_s,
        "max_age_s": topic.max_age_s,
        "publishers": sorted(topic.publishers),
        "readers": sorted(topic.readers),
    }
