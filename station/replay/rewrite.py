"""Writes a recording anew, with what a replay yielded in the place of what the flight did."""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from alight.runtime.clock import nanoseconds
from schemas import topics
from schemas.frame import FrameHeader
from schemas.journal import Journal, JournalEntry
from schemas.message import Message
from schemas.topics import Topic
from services.recorder import layout
from services.recorder.message_file import MessageFile
from station.mcap_parts import StoredMessage
from station.replay.error import ReplayError
from station.replay.recording import ReplayRecording
from station.replay.result import Given, ReplayResult

JOURNAL_PERIOD_NS = nanoseconds(0.25)

_Line = tuple[int, Topic[Any], Message]
"""When it is logged (UTC ns), topic, message."""


def rewrite(
    recording: ReplayRecording,
    result: ReplayResult,
    target: Path,
    keep: Callable[[StoredMessage], bool] = lambda _: True,
) -> None:
    """Write a recording whose replay yields what it holds.

    Inputs and pictures stay as they are. Of the replayed services outputs and journals are those of the replay, and the
    settings are those that it was made with.

    Args:
        recording: The flight.
        result: Its replay.
        target: The file to write; if there is one, it is replaced when the new one is complete.
        keep: Which of the other messages to keep.

    Raises:
        ReplayError: If the recording consists of several files.
        OSError: If the target cannot be written.
    """
    if layout.part(recording.path, 2).exists():
        raise ReplayError(
            f"{recording.path}: a recording of several files cannot be rewritten: choose a flight of one file"
        )
    lines = [*_inputs(recording, result, keep), *_outputs(result), *_journals(result)]
    lines.sort(key=lambda line: line[0])
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        recorder = result.settings.recorder.model_copy(update={"directory": Path(folder)})
        file = MessageFile(result.settings.model_copy(update={"recorder": recorder}))
        for logged_at_ns, topic, message in lines:
            file.add(topic, message, logged_at_ns)
            picture = recording.pictures.stored(message.captured_at_ns) if isinstance(message, FrameHeader) else None
            if picture is not None and isinstance(message, FrameHeader):
                file.add_picture(topic, message, picture, logged_at_ns)
        file.finish()
        if file.failure is not None:
            raise OSError(f"{target}: {file.failure}")
        file.path.replace(target)


def _inputs(recording: ReplayRecording, result: ReplayResult, keep: Callable[[StoredMessage], bool]) -> Iterator[_Line]:
    for stored in recording.stored:
        replaced = (
            stored.sender in result.services if stored.topic is topics.JOURNAL else stored.topic.name in result.counts
        )
        if not replaced and keep(stored):
            yield stored.logged_at_ns, stored.topic, stored.message()
    for name, stamp_ns in result.stand_ins:
        topic = topics.BY_NAME[name]
        stood_in = recording.find(topic, stamp_ns)
        if stood_in is not None:
            yield stood_in.logged_at_ns, topic, stood_in.message()


def _outputs(result: ReplayResult) -> Iterator[_Line]:
    for output in result.outputs:
        yield output.logged_at_ns, topics.BY_NAME[output.topic], output.message


def _journals(result: ReplayResult) -> Iterator[_Line]:
    for service, lives in result.given.items():
        for given in lives:
            yield from _journal(service, given)


def _journal(service: str, given: Given) -> Iterator[_Line]:
    groups = list(_quarters(given.entries))
    for number, entries in enumerate(groups):
        last = number == len(groups) - 1
        at_ns = given.ended_at_ns if last else entries[-1].now_ns
        journal = Journal(
            at_ns=at_ns,
            service=service,
            started_at_ns=given.started_at_ns,
            number=number,
            entries=tuple(entries),
        )
        yield at_ns, topics.JOURNAL, journal


def _quarters(entries: Sequence[JournalEntry]) -> Iterator[list[JournalEntry]]:
    """Entries in portions of a journal's period."""
    portion: list[JournalEntry] = []
    for entry in entries:
        if portion and entry.now_ns - portion[0].now_ns >= JOURNAL_PERIOD_NS:
            yield portion
            portion = []
        portion.append(entry)
    if portion:
        yield portion
