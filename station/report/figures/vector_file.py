"""Writes a figure as SVG and PDF."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from station.report.error import ReportError
from station.report.palette import LIGHT
from station.report.svg import lay_out, style

COLUMN_IN, PAGE_IN = 3.5, 7.2
"""Widths of one column and of a page of two, inches."""


@dataclass(frozen=True)
class VectorFiles:
    """A figure on disk."""

    svg: Path
    pdf: Path


@contextmanager
def print_figure(width_in: float, height_in: float) -> Iterator[Figure]:
    """A figure for print: white ground, readable at this size without scaling."""
    settings: Any = {
        **style(LIGHT),
        "figure.facecolor": "white",
        "savefig.facecolor": "white",
        "font.size": 8,
        "axes.titlesize": 8.5,
        "axes.labelsize": 8.5,
        "xtick.labelsize": 7.5,
        "ytick.labelsize": 7.5,
        "legend.fontsize": 7.5,
        "lines.linewidth": 1.2,
        "grid.linewidth": 0.6,
        "svg.hashsalt": "alight.figure",
    }
    with matplotlib.rc_context(settings):
        yield Figure(figsize=(width_in, height_in), layout=ConstrainedLayoutEngine(w_pad=0.05, h_pad=0.05))


def write_vector(drawn: Figure, directory: Path, name: str) -> VectorFiles:
    """Write both files; the same figure always yields the same bytes. Call it inside the `print_figure` block.

    Raises:
        ReportError: If they cannot be written.
    """
    files = VectorFiles(directory / f"{name}.svg", directory / f"{name}.pdf")
    try:
        directory.mkdir(parents=True, exist_ok=True)
        lay_out(drawn)
        drawn.savefig(files.svg, metadata={"Date": None, "Creator": None})
        drawn.savefig(files.pdf, metadata={"CreationDate": None, "Creator": None, "Producer": None})
    except OSError as error:
        raise ReportError(f"{directory}: figures cannot be written ({error.strerror})") from error
    return files
