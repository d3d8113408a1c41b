"""What a replay says before and after."""

from collections import Counter
from collections.abc import Iterator

from alight.runtime.clock import seconds
from station.republish.choice import Choice
from station.republish.excerpt import Excerpt
from station.republish.player import Played

LATE_S = 0.1
"""Lateness worth a word."""
DAY_S = 86_400.0


def what_is_published(choice: Choice, part: Excerpt, pace: str, now_ns: int | None) -> Iterator[str]:
    """Lines that say what goes onto the bus, and why the rest does not.

    Args:
        choice: The topics.
        part: The messages.
        pace: How fast, in words.
        now_ns: Where recorded stamps are moved to, UTC ns; None if they are left as they are.
    """
    stamps = "as recorded"
    if now_ns is not None:
        stamps = f"moved to now, by {seconds(now_ns - part.began_ns) / DAY_S:+.4f} days"
    yield f"replaying  {seconds(part.ended_ns - part.began_ns):.1f} s {pace}, stamps {stamps}"
    counts = Counter(item.topic.name for item in part.items)
    yield f"publishing {', '.join(f'{name} ({counts[name]})' for name in choice.published)}"
    reasons: dict[str, list[str]] = {}
    for name, reason in choice.left_out.items():
        reasons.setdefault(reason, []).append(name)
    for reason, names in reasons.items():
        yield f"left out   {', '.join(names)}: {reason}"
    if part.without_picture:
        yield f"left out   {part.without_picture} frames: the recording kept no picture of them"


def how_it_went(played: Played) -> Iterator[str]:
    """Lines that say what was published in the end."""
    yield f"published  {', '.join(f'{name} ({count})' for name, count in sorted(played.sent.items())) or 'nothing'}"
    for name, reason in sorted(played.given_up.items()):
        yield f"given up   {name}, in the middle: {reason}"
    if played.damaged_pictures:
        yield f"left out   {played.damaged_pictures} frames: their pictures are damaged"
    if played.latest_s > LATE_S:
        yield f"late       by up to {played.latest_s:.2f} s: this machine does not keep up; try a lower --speed"
