"""Each fix as a stroke, in the row of what became of it."""

from functools import partial
from html import escape

import numpy as np
from matplotlib.figure import Figure

from station.metrics.fix_fate import Fate, FixFate, FixFates
from station.metrics.summary import FlightSummary
from station.report.flight_path import FlightPaths, since_s
from station.report.height_view import shade_phases
from station.report.picture import Picture
from station.report.svg import PAGE, ticks
from station.report.tables import table

_COLOURS = {
    Fate.STEERED: "estimate",
    Fate.USED: "corrected",
    Fate.NO_ESTIMATE: "navigated",
    Fate.UNKNOWN: "navigated",
    Fate.COMMANDER: "setpoint",
    Fate.FILTER: "raw",
    Fate.GEOLOCATOR: "bad",
}
_MOST_LANES = 9

Lane = tuple[str, str, list[FixFate]]
"""Name, colour of the palette, fixes."""


def fixes_picture(summary: FlightSummary, paths: FlightPaths, fates: FixFates) -> Picture:
    """Lanes over time; what was refused has one lane a reason."""
    found = lanes(fates)
    height_in = 1.25 + 0.33 * len(found)
    title = "Each fix over time, in the row of what became of it"
    return Picture("fixes", title, height_in, height_in + 0.2, partial(_draw, summary, paths, found))


def lanes(fates: FixFates) -> list[Lane]:
    """Fixes by fate, and those refused by reason too; the rarest reasons together."""
    rows: list[Lane] = []
    for fate, colour in _COLOURS.items():
        chosen = [one for one in fates.fates if one.fate is fate]
        if fate not in (Fate.GEOLOCATOR, Fate.FILTER, Fate.COMMANDER):
            rows += [(fate.value, colour, chosen)] if chosen else []
            continue
        reasons = sorted({one.reason for one in chosen})
        rows += [
            (f"{fate.value.rsplit(' ', 1)[-1]}: {reason}", colour, [one for one in chosen if one.reason == reason])
            for reason in reasons
        ]
    return rows if len(rows) <= _MOST_LANES else _rarest_together(rows)


def fixes_words(fates: FixFates) -> str:
    """What the picture shows, and how it is known."""
    about = (
        "One stroke a fix, in the row of how far it came: refused by the geolocator, left out by the filter, refused by the "
        "commander, or flown."
    )
    if fates.repeated is None:
        return about
    return (
        f"{about} The filter's log in the recording does not name each fix, so that it was asked again with the recorded ones: "
        f"{fates.repeated} of the {fates.estimates} recorded estimates come out the same to the last digit."
    )


def fixes_table(fates: FixFates) -> str:
    """How many of each, with an example in words."""
    total = max(1, len(fates.fates))
    groups: dict[tuple[Fate, str], list[FixFate]] = {}
    for fate in fates.fates:
        groups.setdefault((fate.fate, fate.reason), []).append(fate)
    rows = [
        (
            fate.value,
            reason,
            str(len(some)),
            f"{len(some) / total:.1%}",
            next((one.detail for one in some if one.detail), ""),
        )
        for (fate, reason), some in sorted(groups.items(), key=lambda item: -len(item[1]))
    ]
    return table(("what became of it", "phase or reason", "fixes", "share", "for example"), rows, frozenset({2, 3}))


def fixes_list(fates: FixFates, paths: FlightPaths) -> str:
    """Every fix in a line, folded away."""
    lines = "\n".join(
        f"{since_s(one.captured_at_ns, paths.origin_ns):+9.3f} s  {one.fate.value}: {one.reason}"
        + (f" ({one.detail})" if one.detail else "")
        for one in fates.fates
    )
    return f"<details><summary>All {len(fates.fates)} fixes, one a line</summary><pre>{escape(lines)}</pre></details>"


def _rarest_together(rows: list[Lane]) -> list[Lane]:
    by_count = sorted(rows, key=lambda row: -len(row[2]))
    rest = by_count[_MOST_LANES - 1 :]
    merged = sorted((fix for row in rest for fix in row[2]), key=lambda fix: fix.captured_at_ns)
    return [row for row in rows if row not in rest] + [(f"{len(rest)} other reasons", "bad", merged)]


def _draw(summary: FlightSummary, paths: FlightPaths, found: list[Lane], drawn: Figure, narrow: bool) -> None:
    axes = drawn.subplots()
    for row, (name, colour, fixes) in enumerate(found):
        t_s = np.array([since_s(fix.captured_at_ns, paths.origin_ns) for fix in fixes])
        ticks(axes, t_s, row - 0.36, row + 0.36, getattr(PAGE, colour), f"fixes {name}")
    axes.set_xlim(*paths.shown_s)
    shade_phases(axes, summary, paths, named=True)
    names = [f"{name}\n{len(fixes)}" if narrow else f"{name} ({len(fixes)})" for name, _, fixes in found]
    axes.set_yticks(range(len(found)), names, fontsize=7.5 if narrow else 9)
    axes.set_ylim(len(found) - 0.4, -0.6)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel(paths.time_label)
