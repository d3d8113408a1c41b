"""How far replayed values are from recorded ones, over time."""

import re
from collections import defaultdict
from collections.abc import Iterator
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from alight.runtime.clock import seconds
from station.replay.result import Output, ReplayResult
from station.report.picture import Picture
from station.report.svg import PAGE

_MOST_FIELDS = 4
_UNIT = re.compile(r"_(px|m|m2|rad|rad2|deg|s|ns|mps|rps)$")

_Series = tuple[str, list[float], list[float]]
"""Field, times in seconds from the first input, replayed minus recorded."""


def difference_pictures(result: ReplayResult) -> Iterator[Picture]:
    """One picture for each topic with numbers that differ."""
    times_ns = [entry.now_ns for lives in result.given.values() for life in lives for entry in life.entries]
    for name in result.counts:
        series = _series([output for output in result.of(name) if output.differences], min(times_ns, default=0))
        if series:
            height_in = 0.9 + 1.25 * len(series)
            title = f"Differences in {name} over time"
            yield Picture(name, title, height_in, height_in, partial(_draw, series))


def _series(outputs: list[Output], origin_ns: int) -> list[_Series]:
    """The field that differs most of each kind of quantity, most kinds first that differ often."""
    points: defaultdict[str, list[tuple[float, float]]] = defaultdict(list)
    for output in outputs:
        for difference in output.differences:
            if difference.apart is not None and not difference.path.startswith("hops"):
                at_s = seconds(output.message.stamp_ns - origin_ns)
                points[difference.path].append((at_s, difference.replayed - difference.recorded))
    best: dict[str, str] = {}
    for path, pairs in points.items():
        kind = _kind(path)
        if kind not in best or _largest(pairs) > _largest(points[best[kind]]):
            best[kind] = path
    chosen = sorted(best.values(), key=lambda path: -len(points[path]))[:_MOST_FIELDS]
    return [(path, [at for at, _ in points[path]], [value for _, value in points[path]]) for path in chosen]


def _largest(pairs: list[tuple[float, float]]) -> float:
    return max(abs(value) for _, value in pairs)


def _kind(path: str) -> str:
    """The field without the numbers of its parts; values of the same unit at the same place are one kind."""
    leaf = re.sub(r"\[\d+\]", "", path).rsplit(".", 1)[-1]
    found = _UNIT.search(leaf)
    return found.group(1) if found else leaf


def _draw(series: list[_Series], drawn: Figure, narrow: bool) -> None:
    axes = np.atleast_1d(drawn.subplots(len(series), 1, sharex=True))
    for one, (path, at_s, values) in zip(axes, series, strict=True):
        one.plot(at_s, values, ".", color=PAGE.estimate, markersize=4)
        one.axhline(0, color=PAGE.ink, linewidth=0.8)
        one.set_title(path if not narrow else path[-40:])
        one.ticklabel_format(axis="y", style="sci", scilimits=(-3, 4))
        one.locator_params(axis="y", nbins=4)
    axes[-1].set_xlabel("time since the first input [s]")
