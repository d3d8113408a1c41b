"""The settings of a recorded flight, for this version of the program."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from alight.runtime.settings_file import assigned, settings_from
from schemas.settings import Settings
from station.replay.recording import ReplayRecording


def settings_of(recording: ReplayRecording, assignments: Sequence[str] = ()) -> tuple[Settings, list[str]]:
    """The flight's settings with assignments (`section.key=value`) over them, and what was left out, in words.

    A key that this version does not know any more is left out; one that the recording does not know yet has its default.

    Raises:
        SettingsError: If a value of the recording is not valid any more, or an assignment is at fault.
    """
    dropped: list[str] = []
    table = _known(recording.settings, Settings, (), dropped)
    settings = settings_from([(f"{recording.path}: settings.json", table), *assigned(assignments)])
    remarks = [f"this version has no setting {name}: the recorded value is left out" for name in dropped]
    if not recording.settings:
        remarks.append("the recording holds no settings: defaults are taken")
    return settings, remarks


def _known(
    table: Mapping[str, Any], section: type[BaseModel], prefix: tuple[str, ...], dropped: list[str]
) -> dict[str, Any]:
    known: dict[str, Any] = {}
    for key, value in table.items():
        field = section.model_fields.get(key)
        if field is None:
            dropped.append(".".join((*prefix, key)))
            continue
        below = next(_sections(field.annotation), None)
        known[key] = _known(value, below, (*prefix, key), dropped) if below and isinstance(value, Mapping) else value
    return known


def _sections(annotation: Any) -> Iterator[type[BaseModel]]:
    """The sections that a key's type names: itself, or one of a union's members."""
    for candidate in (annotation, *getattr(annotation, "__args__", ())):
        if isinstance(candidate, type) and issubclass(candidate, BaseModel):
            yield candidate
