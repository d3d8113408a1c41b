"""The page docs/settings.md, made from the settings' own descriptions: `python -m station.settings_page > docs/settings.md`."""

import sys
from collections.abc import Iterator
from typing import Any, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from schemas.settings import Settings

INTRODUCTION = """\
# Settings

One TOML file, then the environment, then `--set`; later ones win. All keys have defaults, which fly the embedded
simulator. A wrong key or value stops the process at once and says which, where and what to do.

```
alight fly --settings site.toml                  # [camera] rate_hz = 20
ALIGHT_CAMERA__RATE_HZ=20 alight fly             # the environment: two underscores between section and key
alight fly --set camera.rate_hz=20               # the command line
```

Units and frames stand in the names: `_m` metres, `_s` seconds, `_deg` degrees, `_mps` metres a second, `_px` pixels.
"""


def settings_page() -> str:
    """The page as Markdown: one table a section."""
    return "\n".join([INTRODUCTION, *_section("", Settings, None)]) + "\n"


def _section(name: str, section: type[BaseModel], instance: BaseModel | None) -> Iterator[str]:
    values = instance or section()
    kinds = {key: _section_type(field) for key, field in section.model_fields.items()}
    plain = [key for key, kind in kinds.items() if kind is None]
    if plain:
        yield f"## {f'[{name}]' if name else 'Without a section'}\n"
        if name:
            yield f"{(section.__doc__ or '').strip().splitlines()[0]}\n"
        yield "| key | default | meaning |\n|---|---|---|"
        for key in plain:
            yield f"| `{key}` | `{_shown(getattr(values, key))}` | {_meaning(section.model_fields[key])} |"
        yield ""
    for key, kind in kinds.items():
        if kind is not None:
            yield from _section(f"{name}.{key}" if name else key, kind, getattr(values, key))


def _section_type(field: FieldInfo) -> type[BaseModel] | None:
    if get_origin(field.annotation) is tuple:
        return None
    candidates = [field.annotation, *getattr(field.annotation, "__args__", ())]
    for candidate in candidates:
        if isinstance(candidate, type) and issubclass(candidate, BaseModel):
            return candidate
    return None


def _shown(value: Any) -> str:
    if isinstance(value, BaseModel):
        return "{...}"
    return "none" if value is None else str(value).replace("|", "\\|")


def _meaning(field: FieldInfo) -> str:
    bounds = [
        f"{word} {getattr(rule, name):g}"
        for rule in field.metadata
        for name, word in (("ge", "at least"), ("gt", "more than"), ("le", "at most"), ("lt", "less than"))
        if isinstance(getattr(rule, name, None), int | float)
    ]
    text = " ".join((field.description or "").split()).replace("|", "\\|")
    return f"{text} ({', '.join(bounds)})" if bounds else text


if __name__ == "__main__":
    sys.stdout.write(settings_page())
