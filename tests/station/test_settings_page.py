"""The page of settings is what the settings say of themselves."""

from collections.abc import Iterator
from pathlib import Path

from pydantic import BaseModel

from alight.markers.layout import shipped_layouts
from schemas.settings import Settings
from station.settings_page import settings_page

PAGE = Path(__file__).parents[2] / "docs" / "settings.md"


def test_the_committed_page_is_up_to_date() -> None:
    assert PAGE.read_text() == settings_page(), "run: python -m station.settings_page > docs/settings.md"


def test_every_key_says_what_it_means() -> None:
    silent = [name for name, description in described(Settings, "") if not description]
    assert not silent


def test_every_shipped_layout_is_named() -> None:
    told = dict(described(Settings, ""))["pad.layout"] or ""
    assert [name for name in shipped_layouts() if f"`{name}`" not in told] == []


def described(section: type[BaseModel], prefix: str) -> Iterator[tuple[str, str | None]]:
    for key, field in section.model_fields.items():
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            yield from described(inner, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", field.description
