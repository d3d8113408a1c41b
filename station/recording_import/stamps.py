"""When each frame of a video was taken: from a table of stamps, or from a start and a rate."""

import csv
import itertools
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from alight.runtime.clock import nanoseconds
from station.recording_import.source_error import SourceError

UTC_NS, UTC_S, SINCE_START_S = "captured_at_ns", "captured_at_s", "t_s"
"""Columns that a table of stamps may have: UTC in ns, UTC in seconds, seconds after the video's start."""


def stamps_from_table(path: Path, start_ns: int) -> list[int]:
    """Middle of each exposure, UTC ns, one for each frame.

    Args:
        path: CSV with a head line that names one of the columns above; others are left alone. One row a frame, in order.
        start_ns: Where `t_s` counts from, UTC ns.

    Raises:
        SourceError: If the table cannot be read, has no such column, or its times do not ascend.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise SourceError(f"{path}: cannot be read ({error}): check --stamps") from None
    column = next((name for name in (UTC_NS, UTC_S, SINCE_START_S) if rows and name in rows[0]), None)
    if column is None:
        raise SourceError(f"{path}: has no stamps: the first line must name {UTC_NS}, {UTC_S} or {SINCE_START_S}")
    stamps: list[int] = []
    for number, row in enumerate(rows, 2):
        try:
            stamp_ns = _stamp_ns(column, row[column], start_ns)
        except (TypeError, ValueError, OverflowError):
            raise SourceError(f"{path}: line {number}: {column} {row[column]!r} is no number") from None
        if stamp_ns < 0 or (stamps and stamp_ns <= stamps[-1]):
            raise SourceError(f"{path}: line {number}: {column} {row[column]} is not after the frame before it")
        stamps.append(stamp_ns)
    return stamps


def stamps_at_rate(start_ns: int, fps: float) -> Iterator[int]:
    """Stamps of a steady camera, UTC ns, without end.

    Args:
        start_ns: The first frame's, UTC ns.
        fps: Frames a second.
    """
    return (start_ns + nanoseconds(number / fps) for number in itertools.count())


def moment_ns(text: str, log_start_ns: int) -> int:
    """A moment as a person writes it, UTC ns.

    Args:
        text: `+12.5` (seconds after the log's first pose), `2026-05-01T09:30:00.250Z` (ISO 8601; UTC where no zone is given), or
            seconds since the Unix epoch.
        log_start_ns: The log's first pose, UTC ns.

    Raises:
        SourceError: If it is none of these.
    """
    try:
        if text.startswith(("+", "-")):
            return log_start_ns + nanoseconds(float(text))
        if "T" in text or "-" in text:
            moment = datetime.fromisoformat(text)
            aware = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
            since = aware - datetime(1970, 1, 1, tzinfo=UTC)
            return (since.days * 86_400 + since.seconds) * 1_000_000_000 + since.microseconds * 1000
        return nanoseconds(float(text))
    except (ValueError, OverflowError):
        raise SourceError(
            f"--video-start {text}: write +SECONDS after the log's first pose, or UTC as 2026-05-01T09:30:00.250Z"
        ) from None


def _stamp_ns(column: str, text: str, start_ns: int) -> int:
    if column == UTC_NS:
        return int(text)
    return nanoseconds(float(text)) + (start_ns if column == SINCE_START_S else 0)
