"""Where settings come from: one TOML file, then the environment, then `--set`; later ones win.

The environment's names are `ALIGHT_SECTION__KEY` (`ALIGHT_CAMERA__RATE_HZ=20`) and, for the keys without a section,
`ALIGHT_SEED` and `ALIGHT_VEHICLE`. One with a section's name and no two underscores is refused; others are left alone. Values are
read as TOML, and as plain text where that fails.
"""

import difflib
import json
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from schemas.settings import Settings

PREFIX = "ALIGHT_"
TOP_LEVEL = ("seed", "vehicle")

Table = dict[str, Any]


class SettingsError(Exception):
    """A setting that cannot be used: where it stands, which key, why, and what to do. One line."""


def load_settings(
    path: Path | None = None, environment: Mapping[str, str] | None = None, assignments: Iterable[str] = ()
) -> Settings:
    """Read and validate all settings.

    Args:
        path: A TOML file (or JSON, as a flight's own record of its settings is); None for defaults.
        environment: Usually `os.environ`.
        assignments: `section.key=value`, as given with `--set`.

    Raises:
        SettingsError: Naming file, key and remedy.
    """
    layers: list[tuple[str, Table]] = []
    if path is not None:
        layers.append((str(path), _read(path)))
    for name, value in sorted((environment or {}).items()):
        key = _key_of_variable(name)
        if key is not None:
            layers.append((f"environment variable {name}", _nested(key, _value(value))))
    return settings_from([*layers, *assigned(assignments)])


def assigned(assignments: Iterable[str]) -> list[tuple[str, Table]]:
    """The layers of `settings_from` that `section.key=value`, as given with `--set`, make.

    Raises:
        SettingsError: If one of them is not of that form.
    """
    return [
        (f"--set {assignment}", _nested(key, _value(value)))
        for assignment in assignments
        for key, value in [_split(assignment)]
    ]


def settings_from(layers: Iterable[tuple[str, Mapping[str, Any]]]) -> Settings:
    """Merge and validate tables of settings; later ones win.

    Args:
        layers: Where a table comes from, for the message of an error, and the table, nested as in the file.

    Raises:
        SettingsError: Naming source, key and remedy.
    """
    table: Table = {}
    origin: dict[tuple[str, ...], str] = {}
    for source, layer in layers:
        _merge(table, layer, origin, source)
    try:
        return Settings.model_validate(table)
    except ValidationError as error:
        raise SettingsError(_explain(error, origin)) from None


def _read(path: Path) -> Table:
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise SettingsError(
            f"{path}: cannot be read ({error.strerror}): check the path given with --settings"
        ) from None
    try:
        return json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
    except (tomllib.TOMLDecodeError, json.JSONDecodeError) as error:
        raise SettingsError(f"{path}: not valid {path.suffix.lstrip('.') or 'TOML'}: {error}") from None


def _key_of_variable(name: str) -> tuple[str, ...] | None:
    if not name.startswith(PREFIX):
        return None
    key = tuple(name.removeprefix(PREFIX).lower().split("__"))
    if len(key) > 1 or key[0] in TOP_LEVEL:
        return key
    parts = _parts(key[0], Settings)
    if len(parts) > 1:
        meant = PREFIX + "__".join(parts).upper()
        raise SettingsError(
            f"environment variable {name}: two underscores stand between section and key: write {meant}"
        )
    return None


def _parts(name: str, section: type[BaseModel]) -> tuple[str, ...]:
    """Sections and key that a name with single underscores is put together from: `camera_live_url` is camera, live, url."""
    for key in section.model_fields:
        inner = _section(section, key)
        if inner is not None and name.startswith(f"{key}_"):
            return key, *_parts(name.removeprefix(f"{key}_"), inner)
    return (name,)


def _split(assignment: str) -> tuple[tuple[str, ...], str]:
    key, separator, value = assignment.partition("=")
    if not separator or not key.strip():
        raise SettingsError(f"--set {assignment}: write section.key=value, such as --set camera.rate_hz=20")
    return tuple(key.strip().split(".")), value.strip()


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _nested(key: tuple[str, ...], value: Any) -> Table:
    table: Table = {key[-1]: value}
    for part in reversed(key[:-1]):
        table = {part: table}
    return table


def _merge(
    into: Table, table: Mapping[str, Any], origin: dict[tuple[str, ...], str], source: str, prefix: tuple[str, ...] = ()
) -> None:
    for key, value in table.items():
        if isinstance(value, dict) and isinstance(into.get(key, {}), dict):
            _merge(into.setdefault(key, {}), value, origin, source, (*prefix, key))
        else:
            into[key] = value
            origin[(*prefix, key)] = source


def _explain(error: ValidationError, origin: Mapping[tuple[str, ...], str]) -> str:
    first = error.errors(include_url=False)[0]
    key = tuple(str(part) for part in first["loc"])
    within = [source for known, source in origin.items() if known[: len(key)] == key]
    around = [origin[key[:length]] for length in range(len(key), 0, -1) if key[:length] in origin]
    source = next(iter((*around, *within)), "settings")
    dotted = ".".join(key)
    if first["type"] == "extra_forbidden":
        return f"{source}: {dotted} is no setting; {_nearest(key)}"
    given = "" if isinstance(first["input"], dict) else f" (got {first['input']!r})"
    return f"{source}: {dotted}: {first['msg'].removeprefix('Value error, ')}{given}"


def _nearest(key: tuple[str, ...]) -> str:
    section: type[BaseModel] = Settings
    for part in key[:-1]:
        inner = _section(section, part)
        if inner is None:
            break
        section = inner
    names = list(section.model_fields)
    near = difflib.get_close_matches(key[-1], names, n=1)
    if near:
        return f"did you mean {'.'.join((*key[:-1], near[0]))}?"
    return f"there are: {', '.join(names)}" if names else "this section has no keys"


def _section(within: type[BaseModel], key: str) -> type[BaseModel] | None:
    """The section of that name; None if it is no section."""
    annotation = within.model_fields[key].annotation if key in within.model_fields else None
    return annotation if isinstance(annotation, type) and issubclass(annotation, BaseModel) else None
