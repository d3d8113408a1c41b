"""The first message that is not what it was, in words: which, in what, and what its node had been given."""

from collections.abc import Iterator
from datetime import UTC, datetime

from alight.runtime.clock import NS_PER_S
from schemas.journal import EntryKind
from station.replay.result import Origin, Output, ReplayResult

_MOST_FIELDS = 6


def explanation(result: ReplayResult) -> Iterator[str]:
    """Lines about the first divergence; none if there is none."""
    first = result.first_divergence
    missing = result.missing[0] if result.missing else None
    if missing is not None and (first is None or missing.logged_at_ns < first.logged_at_ns):
        yield f"first divergence: {missing.topic.name} of {clock(missing.stamp_ns)} was recorded, and is missing in the replay"
        return
    if first is None:
        return
    if not first.recorded:
        yield f"first divergence: {first.topic} of {clock(first.message.stamp_ns)} is additional: it was not recorded"
    else:
        yield f"first divergence: {first.topic} of {clock(first.message.stamp_ns)}"
        yield from (f"  {line}" for line in field_lines(first))
    yield from (f"  {line}" for line in input_lines(first))


def field_lines(output: Output) -> Iterator[str]:
    """The fields that differ, those that are not tolerated first."""
    ordered = sorted(output.differences, key=lambda difference: difference.within)
    yield from (difference.text() for difference in ordered[:_MOST_FIELDS])
    if len(ordered) > _MOST_FIELDS:
        yield f"and {len(ordered) - _MOST_FIELDS} more fields"


def input_lines(output: Output) -> Iterator[str]:
    """What the node had been given when it published this."""
    entry = output.entry
    cause = {
        EntryKind.MESSAGE: f"{entry.source} of {clock(entry.stamp_ns)}",
        EntryKind.TICK: "the time alone",
        EntryKind.BYTES: f"bytes through the port `{entry.source}`",
    }[entry.kind]
    yield f"published by the {output.service} when, at {clock(entry.now_ns)}, it was given {cause}; by then it had been given"
    for given in output.inputs:
        yield f"  {given.topic} of {clock(given.stamp_ns)}: {given.origin.value}"
    if not output.inputs:
        yield "  no message"
    if all(given.origin in (Origin.RECORDED, Origin.SAME) for given in output.inputs) and output.exact_input:
        yield f"so the {output.service} itself has changed: by its code, by its settings or by what it stands on"


def clock(at_ns: int) -> str:
    """A time of day, UTC, with all its digits."""
    whole_s, rest_ns = divmod(at_ns, NS_PER_S)
    return f"{datetime.fromtimestamp(whole_s, UTC):%H:%M:%S}.{rest_ns:09d}"
