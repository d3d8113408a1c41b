"""The report of a calibration: one HTML file, nothing to load."""

import base64
import html
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from station.calibrate.coverage import Coverage
from station.calibrate.solve import NAMES, Solution
from station.calibrate.views import Chosen

_STYLE = (
    "body{font:15px/1.5 system-ui,sans-serif;max-width:52em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse}td,th{padding:.15em .8em;text-align:right;border-bottom:1px solid #ddd}"
    "td:first-child,th:first-child{text-align:left}img{max-width:100%}.bad{color:#a00}"
)


@dataclass(frozen=True)
class Outcome:
    """All that came of a calibration."""

    title: str
    pictures: int
    found: int
    chosen: Chosen
    coverage: Coverage
    solution: Solution | None
    complaints: tuple[str, ...]
    """Why it may not be used; empty if it may."""


def summary_lines(outcome: Outcome) -> list[str]:
    """What came out, for a terminal."""
    chosen = outcome.chosen
    lines = [
        f"{outcome.pictures} pictures, board found in {outcome.found}, used {len(chosen.used)} "
        f"(too blurred {len(chosen.blurred)}, like another {len(chosen.alike)}); {100 * outcome.coverage.covered:.0f} % of the picture covered"
    ]
    solution = outcome.solution
    if solution is not None:
        lines.append(
            f"reprojection error {solution.rms_px:.3f} px, over views left out in turn {solution.held_out_rms_px:.3f} px"
            + (
                f"; views that do not fit: {', '.join(view.name for view in solution.outliers)}"
                if solution.outliers
                else ""
            )
        )
        lines += parameter_lines(solution)
    return lines


def parameter_lines(solution: Solution) -> list[str]:
    """Each parameter with its standard deviation."""
    return [
        f"{name:<6} {value:>11.5g} +- {sigma:.2g}"
        for name, value, sigma in zip(NAMES, solution.values.tolist(), solution.sigmas.tolist(), strict=True)
    ]


def write_report(outcome: Outcome, coverage_file: Path, file: Path) -> None:
    """Write it; the coverage's picture goes in.

    Raises:
        OSError: If it cannot be written.
    """
    picture = base64.b64encode(coverage_file.read_bytes()).decode("ascii")
    parts = [f"<h1>{html.escape(outcome.title)}</h1>"]
    if outcome.complaints:
        parts += [
            "<h2 class='bad'>Refused</h2><ul>",
            *(f"<li>{html.escape(each)}</li>" for each in outcome.complaints),
            "</ul>",
        ]
    parts.append(f"<p>{html.escape(summary_lines(outcome)[0])}.</p>")
    if outcome.solution is not None:
        parts += _solution_parts(outcome.solution)
    parts.append("<h2>Where corners were seen</h2><p>The lens is known where it is green; elsewhere it is guessed.</p>")
    parts.append(f"<img alt='coverage' src='data:image/png;base64,{picture}'>")
    file.write_text(
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>{html.escape(outcome.title)}</title>"
        f"<style>{_STYLE}</style>{''.join(parts)}</html>\n",
        encoding="utf-8",
    )


def _solution_parts(solution: Solution) -> Iterable[str]:
    width, height = solution.size_px
    yield f"<h2>Camera, {width} x {height}</h2>"
    values = zip(NAMES, solution.values.tolist(), solution.sigmas.tolist(), strict=True)
    yield _table(
        ("parameter", "value", "standard deviation"), [(name, f"{v:.6g}", f"{s:.2g}") for name, v, s in values]
    )
    yield (
        "<p>The standard deviation is the larger of what the corners' scatter says and what leaving views out changes "
        f"(jackknife). Reprojection error {solution.rms_px:.3f} px; over views that were left out in turn "
        f"{solution.held_out_rms_px:.3f} px.</p><h2>Views</h2>"
    )
    rows = [
        (view.name, f"{rms_px:.3f}", f"{math.degrees(tilt):.0f}", f"{view.blur_px:.2f}", str(len(view.corners.pixels)))
        for view, rms_px, tilt in zip(solution.views, solution.view_rms_px, solution.tilts_rad, strict=True)
    ]
    rows += [(f"{view.name} (left out, does not fit)", "", "", f"{view.blur_px:.2f}", "") for view in solution.outliers]
    yield _table(("view", "error, px", "tilt, deg", "blur, px", "corners"), rows)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    cells = ["<tr>" + "".join(f"<th>{html.escape(each)}</th>" for each in head) + "</tr>"]
    cells += ["<tr>" + "".join(f"<td>{html.escape(each)}</td>" for each in row) + "</tr>" for row in rows]
    return f"<table>{''.join(cells)}</table>"
