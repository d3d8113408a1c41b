"""JSON Schemas in the plain dialect that MCAP viewers read.

Foxglove's reader of JSON Schemas knows objects, arrays of one plain type, strings, numbers and booleans: no `$ref`, no
`anyOf`, no `prefixItems`, no arrays of arrays. A channel whose schema has one of these does not open at all. What such
a viewer cannot be told is left out of the schema, so every recorded message is still valid under it.
"""

from typing import Any

from schemas.message import Message

JsonSchema = dict[str, Any]

COMPRESSED_IMAGE: JsonSchema = {
    "title": "foxglove.CompressedImage",
    "description": "One camera frame as a compressed picture.",
    "type": "object",
    "properties": {
        "timestamp": {
            "type": "object",
            "title": "time",
            "description": "Middle of the exposure, UTC.",
            "properties": {
                "sec": {"type": "integer", "minimum": 0, "description": "Whole seconds."},
                "nsec": {"type": "integer", "minimum": 0, "maximum": 999_999_999, "description": "Nanoseconds beyond."},
            },
        },
        "frame_id": {"type": "string", "description": "Frame of reference: the camera's."},
        "data": {"type": "string", "contentEncoding": "base64", "description": "The compressed picture."},
        "format": {"type": "string", "description": "`jpeg` or `png`."},
    },
}


def viewer_schema(message: type[Message]) -> JsonSchema:
    """The schema of a message as it is recorded: absent fields instead of null ones."""
    schema = message.model_json_schema(mode="serialization")
    return _plain_object(schema, schema.get("$defs", {}))


def _plain(schema: JsonSchema, definitions: JsonSchema) -> JsonSchema | None:
    """The same in plain words; None for what the dialect has no words for."""
    if "$ref" in schema:
        target = definitions[schema["$ref"].removeprefix("#/$defs/")]
        return _plain({**target, **{key: value for key, value in schema.items() if key != "$ref"}}, definitions)
    if "anyOf" in schema:
        options = [option for option in schema["anyOf"] if option.get("type") != "null"]
        rest = {key: value for key, value in schema.items() if key not in ("anyOf", "default")}
        return _plain({**options[0], **rest}, definitions) if len(options) == 1 else None
    if schema.get("type") == "object":
        return _plain_object(schema, definitions)
    if schema.get("type") == "array":
        return _plain_array(schema, definitions)
    return schema if "type" in schema else None


def _plain_object(schema: JsonSchema, definitions: JsonSchema) -> JsonSchema:
    given = schema.get("properties", {})
    plain = {name: _plain(field, definitions) for name, field in given.items()}
    nullable = {name for name, field in given.items() if "anyOf" in field}
    result = {key: value for key, value in schema.items() if key not in ("$defs", "additionalProperties")}
    result["properties"] = {name: field for name, field in plain.items() if field is not None}
    result["required"] = [name for name in schema.get("required", ()) if name not in nullable]
    return result


def _plain_array(schema: JsonSchema, definitions: JsonSchema) -> JsonSchema | None:
    kinds = schema.get("prefixItems") or [schema["items"]]
    item = _plain(kinds[0], definitions)
    if item is None or item["type"] == "array" or any(kind != kinds[0] for kind in kinds):
        return None
    return {**{key: value for key, value in schema.items() if key != "prefixItems"}, "items": item}
