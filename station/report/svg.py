"""Figures as SVG inside a page: their colours are the page's own, so that they follow light and dark."""

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields
from html import escape
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.text import Text
from numpy.typing import ArrayLike

from station.report.palette import Palette, variable

PAGE = Palette(**{field.name: f"#01{number:04x}" for number, field in enumerate(fields(Palette), start=1)})
"""Placeholders that no real colour looks like; `inline_svg` puts the page's CSS variables in their place."""


def style(palette: Palette) -> dict[str, Any]:
    """Matplotlib's settings for every figure, whether on a page or in a file."""
    return {
        "figure.facecolor": "none",
        "axes.facecolor": "none",
        "savefig.facecolor": "none",
        "axes.edgecolor": palette.muted,
        "axes.labelcolor": palette.ink,
        "axes.titlecolor": palette.ink,
        "axes.titlesize": 10.5,
        "axes.titleweight": "bold",
        "axes.titlelocation": "left",
        "axes.labelsize": 9.5,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "axes.axisbelow": True,
        "grid.color": palette.faint,
        "grid.linewidth": 0.8,
        "text.color": palette.ink,
        "xtick.color": palette.muted,
        "ytick.color": palette.muted,
        "xtick.labelcolor": palette.ink,
        "ytick.labelcolor": palette.ink,
        "xtick.labelsize": 9,
        "ytick.labelsize": 9,
        "legend.frameon": False,
        "legend.fontsize": 9,
        "legend.labelcolor": palette.ink,
        "font.family": "DejaVu Sans",
        "lines.linewidth": 1.8,
        "path.simplify": False,
        "svg.fonttype": "path",
        "pdf.fonttype": 42,
    }


@contextmanager
def figure(width_in: float, height_in: float, name: str) -> Iterator[Figure]:
    """A figure in the page's style; the name makes the ids inside it its own, and the same each time."""
    settings: Any = {**style(PAGE), "svg.hashsalt": f"alight.{name}"}
    with matplotlib.rc_context(settings):
        yield Figure(figsize=(width_in, height_in), layout=ConstrainedLayoutEngine(w_pad=0.1, h_pad=0.06))


def inline_svg(drawn: Figure, title: str, name: str) -> str:
    """The figure as an SVG element; call it inside the `figure` block. Its glyphs get ids of the name's own."""
    buffer = io.StringIO()
    lay_out(drawn)
    drawn.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->\s*", "", text, flags=re.DOTALL)
    text = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', rf'\1 role="img" aria-label="{escape(title)}"', text, count=1)
    text = re.sub(r"(\d\.\d\d\d)\d+", r"\1", text)
    text = re.sub(r'(id="|href="#)DejaVuSans', rf"\1{name}", text)
    for field in fields(Palette):
        text = text.replace(getattr(PAGE, field.name), f"var({variable(field.name)})")
    return text


def lay_out(drawn: Figure) -> None:
    """Place everything, once and for all: left to itself matplotlib draws a whole trial picture for that."""
    engine = drawn.get_layout_engine()
    if engine is not None:
        engine.execute(drawn)
        drawn.set_layout_engine("none")


def dots(
    axes: Axes,
    x: ArrayLike,
    y: ArrayLike,
    size_pt: float,
    colour: str,
    name: str,
    *,
    alpha: float = 0.55,
    zorder: float = 2.0,
) -> None:
    """Round dots as one path: a twentieth of the size that a scatter of single marks takes.

    Args:
        axes: Where.
        x: (N,) data coordinates.
        y: The same.
        size_pt: Diameter, points.
        colour: Of the palette.
        name: For the legend; what begins with an underscore is left out of it.
        alpha: Opacity.
        zorder: What is higher lies above.
    """
    columns, rows = np.asarray(x, float), np.asarray(y, float)
    drawn = axes.plot(
        _each_twice(columns), _each_twice(rows), color=colour, alpha=alpha, linewidth=size_pt,
        solid_capstyle="round", label=f"_{name}", zorder=zorder,
    )  # fmt: skip
    drawn[0].set_gid(f"dots {name}")
    if not name.startswith("_"):
        axes.plot([], [], "o", color=colour, markersize=2 + size_pt, markeredgewidth=0, label=name)


def ticks(axes: Axes, x: ArrayLike, low: float, high: float, colour: str, name: str) -> None:
    """Upright strokes from low to high at each x (N,), as one path with the name as its id."""
    columns = np.asarray(x, float)
    heights = np.tile([low, high, np.nan], len(columns))
    drawn = axes.plot(
        np.repeat(columns, 3), heights, color=colour, linewidth=1.0, solid_capstyle="butt", label=f"_{name}"
    )
    drawn[0].set_gid(name)


def texts_outside(drawn: Figure) -> Sequence[str]:
    """The texts that the figure's edge cuts: there must be none."""
    drawn.draw_without_rendering()
    width, height = drawn.bbox.width, drawn.bbox.height
    cut = []
    for text in _texts(drawn):
        box = text.get_window_extent()
        if box.x0 < -0.5 or box.y0 < -0.5 or box.x1 > width + 0.5 or box.y1 > height + 0.5:
            cut.append(text.get_text())
    return cut


def texts_overlapping(drawn: Figure) -> Sequence[tuple[str, str]]:
    """Pairs of texts that lie on each other: there must be none."""
    drawn.draw_without_rendering()
    boxes = [(text.get_text(), text.get_window_extent()) for text in _texts(drawn)]
    return [
        (one, other)
        for number, (one, box) in enumerate(boxes)
        for other, beside in boxes[number + 1 :]
        if min(box.x1, beside.x1) - max(box.x0, beside.x0) > 1 and min(box.y1, beside.y1) - max(box.y0, beside.y0) > 1
    ]


def _texts(drawn: Figure) -> list[Text]:
    """What is drawn: matplotlib also keeps tick labels beyond the limits, which are not."""
    found = list(drawn.texts)
    for legend in (*drawn.legends, *(legend for axes in drawn.axes if (legend := axes.get_legend()))):
        found += legend.get_texts()
    for axes in drawn.axes:
        titles = [child for child in axes.get_children() if isinstance(child, Text)]
        found += [*titles, axes.xaxis.label, axes.yaxis.label, *_tick_labels(axes.xaxis), *_tick_labels(axes.yaxis)]
    return [text for text in found if text.get_visible() and text.get_text().strip()]


def _tick_labels(axis: Axis) -> list[Text]:
    low, high = sorted(axis.get_view_interval())
    labels = zip(axis.get_majorticklocs(), axis.get_majorticklabels(), strict=False)
    return [label for place, label in labels if low <= place <= high]


def _each_twice(values: np.ndarray[Any, np.dtype[np.float64]]) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.stack([values, values, np.full(len(values), np.nan)], axis=1).ravel()
