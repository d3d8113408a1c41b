"""What `alight schema export` wrote: keys, encodings and schemas, and the messages that keep to them."""

import json
from pathlib import Path
from typing import Any

import jsonschema
import zenoh


class UnusableError(Exception):
    """A message that cannot be used, and why."""


class Contract:
    """The exported folder: keys, encodings and schemas by topic."""

    def __init__(self, directory: Path, service: str, vehicle: str | None) -> None:
        """Read the folder, for one service of one vehicle (None: the export's default)."""
        self.index = json.loads((directory / "topics.json").read_text())
        self._names = {"vehicle": vehicle or self.index["default_vehicle"], "service": service}
        self._rows = {row["name"]: row for row in self.index["topics"]}
        self._validators = {
            name: jsonschema.Draft202012Validator(json.loads((directory / row["schema"]).read_text()))
            for name, row in self._rows.items()
        }

    def key(self, expression: str) -> str:
        """A key expression of the export with the names of vehicle and service put in."""
        return expression.format(**self._names)

    def topic_key(self, topic: str) -> str:
        """Where a topic's messages travel."""
        return self.key(self._rows[topic]["key_expression"])

    def encoding(self, topic: str) -> str:
        """The Zenoh encoding of a topic's messages: it names the message and the version of the schemas."""
        return str(self._rows[topic]["encoding"])

    def read(self, topic: str, sample: zenoh.Sample) -> dict[str, Any]:
        """A message that came in.

        Raises:
            UnusableError: If it is of another version or does not keep to its schema.
        """
        if str(sample.encoding) != self.encoding(topic):
            raise UnusableError(f"{topic}: got {sample.encoding}, these schemas are for {self.encoding(topic)}")
        source = sample.payload if self._rows[topic]["attachment"] is None else sample.attachment
        try:
            message = json.loads(source.to_bytes() if source is not None else b"")
        except ValueError as error:
            raise UnusableError(f"{topic}: not JSON: {error}") from None
        self._check(topic, message)
        return dict(message)

    def write(self, topic: str, message: dict[str, Any]) -> bytes:
        """A message that goes out, checked first.

        Raises:
            UnusableError: If it does not keep to its schema, or holds NaN or infinity, which no schema can forbid.
        """
        self._check(topic, message)
        try:
            return json.dumps(message, allow_nan=False).encode()
        except ValueError as error:
            raise UnusableError(f"{topic}: {error}") from None

    def _check(self, topic: str, message: object) -> None:
        error = next(self._validators[topic].iter_errors(message), None)
        if error is not None:
            raise UnusableError(f"{topic}: {error.json_path}: {error.message[:200]}")
