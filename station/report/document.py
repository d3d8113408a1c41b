"""The frame of every page: style and all in one HTML text, nothing fetched from anywhere."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files

from station.report.palette import style_rules


@dataclass(frozen=True)
class Section:
    """A heading, a sentence on what is to be seen, and that."""

    title: str
    explanation: str
    content: str

    def html(self) -> str:
        """The section; the explanation is text, the content is HTML."""
        return f"<section><h2>{escape(self.title)}</h2><p>{escape(self.explanation)}</p>{self.content}</section>"


def document(title: str, heading: str, about: str, body: str, version: str) -> str:
    """A whole page; the texts are escaped, the body is HTML."""
    style = style_rules() + files("station.report").joinpath("style.css").read_text()
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{style}</style></head><body><main>"
        f"<header><h1>{escape(heading)}</h1><p>{escape(about)}</p></header>{body}"
        f"<footer>Alight {escape(version)}. This page is complete in itself.</footer>"
        "</main></body></html>\n"
    )


def banner(line: str, *, good: bool) -> str:
    """The page in one line."""
    return f'<div class="verdict {"good" if good else "bad"}">{escape(line[0].upper() + line[1:])}</div>'


def cards(numbers: Sequence[tuple[str, str]]) -> str:
    """Numbers at a glance, each with what it is."""
    each = "".join(f"<div><b>{escape(value)}</b><span>{escape(name)}</span></div>" for value, name in numbers)
    return f'<div class="numbers">{each}</div>' if each else ""
