"""Figures as SVG inside a page: their colours are the page's own, so that they follow light and dark."""

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib
from matplotlib.figure import Figure

INK, MUTED, FAINT, PAPER = "#010101", "#020202", "#030303", "#040404"
TRUTH, NAVIGATED, SETPOINT, RAW, CORRECTED, ESTIMATE = "#110101", "#110102", "#110103", "#110104", "#110105", "#110106"
GOOD, BAD = "#110107", "#110108"
SERVICE_COLOURS = {
    "camera": "#120101",
    "detector": "#120102",
    "geolocator": "#120103",
    "filter": "#120104",
    "commander": "#120105",
}
"""Placeholders that no real colour looks like; `inline_svg` puts the page's CSS variables in their place."""

_VARIABLES = {
    INK: "--ink", MUTED: "--muted", FAINT: "--faint", PAPER: "--paper", TRUTH: "--truth", NAVIGATED: "--navigated",
    SETPOINT: "--setpoint", RAW: "--raw", CORRECTED: "--corrected", ESTIMATE: "--estimate", GOOD: "--good",
    BAD: "--bad", **{colour: f"--{service}" for service, colour in SERVICE_COLOURS.items()},
}  # fmt: skip

_STYLE: Any = {
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "savefig.facecolor": "none",
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": FAINT,
    "grid.linewidth": 0.8,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "legend.labelcolor": INK,
    "font.family": "DejaVu Sans",
    "lines.linewidth": 1.8,
    "svg.fonttype": "path",
}


@contextmanager
def figure(width_in: float, height_in: float, name: str) -> Iterator[Figure]:
    """A figure in the page's style; the name makes the ids inside it its own, and the same each time."""
    with matplotlib.rc_context({**_STYLE, "svg.hashsalt": f"alight.{name}"}):
        yield Figure(figsize=(width_in, height_in), layout="constrained")


def inline_svg(drawn: Figure, title: str) -> str:
    """The figure as an SVG element; call it inside the `figure` block."""
    buffer = io.StringIO()
    drawn.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', rf'\1 role="img" aria-label="{title}"', text, count=1)
    for colour, variable in _VARIABLES.items():
        text = text.replace(colour, f"var({variable})")
    return text
