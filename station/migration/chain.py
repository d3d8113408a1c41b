"""All steps in a row: what any version recorded becomes what this program reads."""

import json
import re
from collections.abc import Sequence

from schemas.message import SCHEMA_VERSION
from station.migration.step import Step
from station.migration.v1_to_v2 import V1_TO_V2
from station.migration.v2_to_v3 import V2_TO_V3

STEPS: Sequence[Step] = (V1_TO_V2, V2_TO_V3)
OLDEST_VERSION = 1

_ENCODING = re.compile(r"[^;]*;alight\.(?P<message>\w+)\.v(?P<version>\d+)")


class MigrationError(ValueError):
    """What cannot be brought to the present version: which version it is of, and which ones can be read."""


def recorded_as(encoding: str) -> tuple[str, int] | None:
    """Message and schema version that a channel's wire encoding names, such as `application/json;alight.PadFix.v1`; None if none.

    Raises:
        MigrationError: If it is of a version that this program does not know.
    """
    found = _ENCODING.fullmatch(encoding)
    if found is None:
        return None
    version = int(found["version"])
    if not OLDEST_VERSION <= version <= SCHEMA_VERSION:
        known = f"versions {OLDEST_VERSION} to {SCHEMA_VERSION}"
        remedy = "update Alight to read it" if version > SCHEMA_VERSION else "no such version was ever released"
        raise MigrationError(
            f"{found['message']} was recorded with schema version {version}, this program reads {known}: {remedy}"
        )
    return found["message"], version


def migrated(message: str, version: int, text: bytes) -> bytes:
    """The JSON text of a message of any known version, as the present version writes it; untouched where nothing changed.

    Args:
        message: Its type, such as `PadFix`.
        version: The schema version that it was written with.
        text: JSON.

    Raises:
        ValueError: If a change applies and the text is no JSON object.
    """
    changes = [step.changes[message] for step in STEPS if step.from_version >= version and message in step.changes]
    if not changes:
        return text
    content = json.loads(text)
    if not isinstance(content, dict):
        raise ValueError(f"{message}: not a JSON object")
    for change in changes:
        content = change(content)
    return json.dumps(content, separators=(",", ":")).encode()
