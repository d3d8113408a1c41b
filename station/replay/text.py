"""A replay's outcome on a terminal, and as JSON."""

from collections.abc import Iterator
from typing import Any

from station.replay.explanation import explanation
from station.replay.result import Output, ReplayResult
from station.replay.score import Score

_COLUMNS = ("same", "tolerated", "different", "additional", "missing", "stand-in", "not compared")


def result_lines(result: ReplayResult) -> Iterator[str]:
    """The outcome: totals by topic, what keeps it from being exact, the first divergence, the verdict."""
    speed = result.flown_s / result.took_s if result.took_s else 0.0
    yield (
        f"replayed {result.flown_s:.1f} s through {', '.join(result.services)} in {result.took_s:.1f} s "
        f"({speed:.1f} times real time); tolerances: {result.tolerances}"
    )
    width = max((len(name) for name in result.counts), default=0)
    yield f"{'':{width}}  " + "  ".join(f"{name:>10}" for name in _COLUMNS)
    for name, c in result.counts.items():
        numbers = (c.same, c.tolerated, c.different, c.additional, c.missing, c.stand_in, c.uncovered)
        cells = (f"{number or '-':>{max(10, len(head))}}" for head, number in zip(_COLUMNS, numbers, strict=True))
        yield f"{name:{width}}  " + "  ".join(cells)
    for remark in remark_lines(result):
        yield f"note: {remark}"
    yield from explanation(result)
    yield verdict(result)


def remark_lines(result: ReplayResult) -> Iterator[str]:
    """What keeps the replay from being exact."""
    yield from result.remarks
    for name, count in sorted(result.absent.items()):
        yield f"{count} messages of {name} that the nodes were given are not in the recording"


def verdict(result: ReplayResult) -> str:
    """The outcome in a line."""
    if result.equal:
        exactly = (
            "to the last bit" if all(not count.tolerated for count in result.counts.values()) else "within tolerance"
        )
        return f"equal {exactly}: {sum(c.same + c.tolerated for c in result.counts.values())} messages compared"
    if not any(c.same + c.tolerated + c.different for c in result.counts.values()):
        return "nothing could be compared"
    counts = result.counts.values()
    return (
        f"not equal: {sum(c.different for c in counts)} messages different, {sum(c.additional for c in counts)} additional, "
        f"{sum(c.missing for c in counts)} missing"
    )


def score_lines(recorded: Score, replayed: Score) -> Iterator[str]:
    """Two scores side by side."""
    rows = list(zip(recorded.rows(), replayed.rows(), strict=True))
    width = max(len(name) for (name, _), _ in rows)
    yield f"{'scored against ' + recorded.reference:{width}}  {'recorded':>12}  {'replayed':>12}"
    for (name, one), (_, other) in rows:
        yield f"{name:{width}}  {one:>12}  {other:>12}"


def as_json(result: ReplayResult, scores: tuple[Score, Score] | None) -> dict[str, Any]:
    """The outcome for machines."""
    first = result.first_divergence
    return {
        "equal": result.equal,
        "services": result.services,
        "set": result.assignments,
        "tolerances": result.tolerances,
        "flown_s": round(result.flown_s, 3),
        "took_s": round(result.took_s, 3),
        "topics": {name: vars(count) for name, count in result.counts.items()},
        "remarks": list(remark_lines(result)),
        "first_divergence": None if first is None else _divergence(first),
        "first_missing": _missing(result),
        "scores": None if scores is None else {"recorded": vars(scores[0]), "replayed": vars(scores[1])},
    }


def _missing(result: ReplayResult) -> dict[str, Any] | None:
    if not result.missing:
        return None
    return {"topic": result.missing[0].topic.name, "stamp_ns": result.missing[0].stamp_ns}


def _divergence(output: Output) -> dict[str, Any]:
    entry = output.entry
    return {
        "topic": output.topic,
        "service": output.service,
        "stamp_ns": output.message.stamp_ns,
        "origin": output.origin.name.lower(),
        "fields": [
            {
                "path": difference.path,
                "recorded": _plain(difference.recorded),
                "replayed": _plain(difference.replayed),
                "ulps": difference.ulps,
                "tolerance": str(difference.tolerance),
            }
            for difference in output.differences
        ],
        "cause": {"kind": entry.kind.value, "source": entry.source, "stamp_ns": entry.stamp_ns, "now_ns": entry.now_ns},
        "inputs": [
            {"topic": given.topic, "stamp_ns": given.stamp_ns, "origin": given.origin.name.lower()}
            for given in output.inputs
        ],
    }


def _plain(value: Any) -> Any:
    return value if isinstance(value, int | float | str | None) else str(value)
