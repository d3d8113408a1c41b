"""The flight's settings: what differs from the defaults first."""

import json
from collections.abc import Mapping
from html import escape
from typing import Any

from schemas.settings import Settings
from station.report.tables import table


def configuration(settings: Mapping[str, Any]) -> str:
    """What was set, then everything."""
    if not settings:
        return "<p>The recording holds no settings.</p>"
    rows = differences(settings)
    differing = (
        table(("setting", "this flight", "default"), rows) if rows else "<p>Nothing differs from the defaults.</p>"
    )
    whole = escape(json.dumps(settings, indent=2))
    return f"{differing}<details><summary>All settings</summary><pre>{whole}</pre></details>"


def differences(settings: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Key, value of the flight, default; in the order of the settings, for every key that differs.

    A key that this version does not know has the default `unknown`.
    """
    defaults = _flat(Settings().model_dump(mode="json"))
    return [
        (key, _text(value), _text(defaults[key]) if key in defaults else "unknown")
        for key, value in _flat(settings).items()
        if key not in defaults or defaults[key] != value
    ]


def _flat(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    leaves: dict[str, Any] = {}
    for key, value in tree.items():
        name = f"{prefix}{key}"
        leaves |= _flat(value, f"{name}.") if isinstance(value, Mapping) and value else {name: value}
    return leaves


def _text(value: Any) -> str:
    return value if isinstance(value, str) and value else json.dumps(value)
