"""A campaign in a few lines: how many landed, how far from the centre, and why the others did not."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from station.campaign.row import Row

_Z95 = 1.959963984540054
"""Quantile of the standard normal distribution that leaves 2.5 % above."""
_NUMBER = re.compile(r"\d+(\.\d+)?")
_MOST_GROUPS = 24


@dataclass(frozen=True)
class Errors:
    """Horizontal error at the first contact of the flights that landed, metres."""

    median_m: float
    p95_m: float
    worst_m: float


@dataclass(frozen=True)
class CampaignSummary:
    """All flights, or those of one combination."""

    flights: int
    landed: int
    interval: tuple[float, float]
    """Wilson's 95 % interval of the share that lands, 0 to 1."""
    errors: Errors | None
    failures: tuple[tuple[str, int, int], ...]
    """Why flights did not land on the pad: the reason (numbers left out), how many, and the first one's index; most frequent first."""


def summarise_rows(rows: Iterable[Row]) -> CampaignSummary:
    """Count and measure."""
    rows = sorted(rows, key=lambda row: int(row["index"]))
    landed = [row for row in rows if row["landed"]]
    failed = [row for row in rows if not row["landed"]]
    first: dict[str, int] = {}
    for row in failed:
        first.setdefault(_sameness(row), int(row["index"]))
    counts = Counter(_sameness(row) for row in failed)
    failures = sorted(((reason, count, first[reason]) for reason, count in counts.items()), key=lambda f: (-f[1], f[2]))
    errors_m = [float(row["touchdown_error_m"]) for row in landed if row["touchdown_error_m"] is not None]
    interval = wilson_interval(len(landed), len(rows))
    return CampaignSummary(len(rows), len(landed), interval, _errors(errors_m), tuple(failures))


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """95 % score interval of a share (Wilson 1927); (0, 1) of nothing."""
    if trials == 0:
        return 0.0, 1.0
    share, z2 = successes / trials, _Z95**2
    centre = (share + z2 / (2 * trials)) / (1 + z2 / trials)
    half = _Z95 / (1 + z2 / trials) * math.sqrt(share * (1 - share) / trials + z2 / (4 * trials**2))
    low = 0.0 if successes == 0 else centre - half
    high = 1.0 if successes == trials else centre + half
    return low, high


def summary_text(rows: Sequence[Row], listed: Sequence[str]) -> Iterator[str]:
    """Lines for the terminal.

    Args:
        rows: All flights.
        listed: Keys of the factors whose values were listed: each combination gets a line of its own.
    """
    whole = summarise_rows(rows)
    yield f"landed     {_landed(whole)}"
    if whole.errors:
        yield f"touchdown  {_error(whole)}"
    for reason, count, index in whole.failures:
        yield f"failed     {count} x {reason} (first: flight {index})"
    groups: dict[tuple[str, ...], list[Row]] = {}
    for row in sorted(rows, key=lambda row: int(row["index"])):
        groups.setdefault(tuple(str(row[key]) for key in listed), []).append(row)
    if 1 < len(groups) <= _MOST_GROUPS:
        yield ""
        for values, group in groups.items():
            named = ", ".join(f"{key} = {value}" for key, value in zip(listed, values, strict=True))
            part = summarise_rows(group)
            yield f"{named}: landed {_landed(part)}" + (f"; {_error(part)}" if part.errors else "")


def _landed(summary: CampaignSummary) -> str:
    low, high = summary.interval
    share = summary.landed / summary.flights if summary.flights else 0.0
    return f"{summary.landed} of {summary.flights} ({share:.1%}; 95 % interval {low:.1%} to {high:.1%})"


def _error(summary: CampaignSummary) -> str:
    assert summary.errors is not None
    errors = summary.errors
    return (
        f"error median {100 * errors.median_m:.1f} cm, 95 % below {100 * errors.p95_m:.1f} cm, "
        f"worst {100 * errors.worst_m:.1f} cm"
    )


def _errors(errors_m: Sequence[float]) -> Errors | None:
    if not errors_m:
        return None
    median_m, p95_m = np.percentile(errors_m, (50, 95))
    return Errors(float(median_m), float(p95_m), max(errors_m))


def _sameness(row: Row) -> str:
    return f"{row['outcome']}: {_NUMBER.sub('#', str(row['reason']))}"
