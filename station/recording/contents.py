"""Checks what the messages of an MCAP file say: each against the schema beside it, each picture decoded."""

import importlib.util
import json
from collections import Counter
from collections.abc import Callable
from io import BytesIO
from typing import Any

from mcap.exceptions import McapError
from mcap.reader import make_reader

from services.recorder import layout
from station.recorded_picture import decoded_picture
from station.recording.structure import Structure

Validator = Callable[[Any], str | None]


def examine_contents(structure: Structure) -> list[str]:
    """What is wrong with the messages, in words, each fault once with its count."""
    faults: Counter[str] = Counter()
    validators: dict[int, Validator] = {}
    for message in structure.messages:
        channel = structure.channels.get(message.channel_id)
        if channel is None:
            continue
        if channel.topic.endswith(f"/{layout.IMAGE}") and decoded_picture(message.data) is None:
            faults[f"{channel.topic}: not a picture"] += 1
        if channel.message_encoding == "json":
            if channel.schema_id not in validators:
                validators[channel.schema_id] = _validator(structure.schemas.get(channel.schema_id))
            fault = _fault(validators[channel.schema_id], message.data)
            if fault is not None:
                faults[f"{channel.topic}: {fault}"] += 1
    return [f"{text} ({count} times)" for text, count in faults.items()]


def examine_reading(data: bytes, structure: Structure) -> list[str]:
    """Whether a reader that follows the index finds the same messages as one that goes front to back."""
    # At equal times the file's order decides, for the reader as for `sorted`.
    scanned = sorted(structure.messages, key=lambda message: message.log_time)
    try:
        indexed = [message for _, _, message in make_reader(BytesIO(data), validate_crcs=True).iter_messages()]
    except (McapError, ValueError) as error:
        return [f"cannot be read by its index: {error}"]
    return [] if indexed == scanned else ["read by its index it has other messages than read front to back"]


def can_validate() -> bool:
    """Whether the validator of JSON Schemas is installed (the extra `test`)."""
    return importlib.util.find_spec("jsonschema") is not None


def _validator(schema: Any) -> Validator:
    if schema is None or schema.encoding != "jsonschema":
        return lambda _: "JSON without a JSON Schema"
    if not can_validate():
        return lambda _: None
    import jsonschema  # noqa: PLC0415 - an extra

    text = json.loads(schema.data)
    kind = jsonschema.validators.validator_for(text, default=jsonschema.Draft202012Validator)
    kind.check_schema(text)
    validator = kind(text)

    def first(content: Any) -> str | None:
        error = next(validator.iter_errors(content), None)
        return None if error is None else f"{error.json_path}: {error.message[:100]}"

    return first


def _fault(validator: Validator, data: bytes) -> str | None:
    try:
        return validator(json.loads(data))
    except ValueError:
        return "not JSON"
