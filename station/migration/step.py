"""What a step between two versions of the schemas is."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

Json = dict[str, Any]
Change = Callable[[Json], Json]
"""A pure function on the JSON of one message: defined for every message of the older version, and without effect on what it has
changed already."""


@dataclass(frozen=True)
class Step:
    """How the messages of one version become those of the next."""

    from_version: int
    """The version that it takes; it gives the next one."""
    changes: Mapping[str, Change]
    """By message, such as `PadFix`; messages that are not named are the same in both versions."""
