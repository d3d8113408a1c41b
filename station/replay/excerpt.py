"""A part of a recording as a flight of its own: from one time to another, every node built anew at the beginning."""

from collections.abc import Callable, Iterator
from pathlib import Path

from schemas import topics
from schemas.frame import FrameHeader
from schemas.journal import Journal
from schemas.message import Message
from services.recorder.message_file import MessageFile
from station.mcap_parts import StoredMessage
from station.replay.recorded_settings import settings_of
from station.replay.recording import ReplayRecording


def write_excerpt(
    recording: ReplayRecording, begin_ns: int, end_ns: int, target: Path, keep: Callable[[StoredMessage], bool]
) -> None:
    """Write what was logged from one time to another, and the journals' entries of that time.

    The nodes knew more then than the excerpt tells: its outputs are made its own by `--update`.

    Args:
        recording: The flight.
        begin_ns: The beginning, UTC ns.
        end_ns: The end, UTC ns.
        target: The file to write; there must be none.
        keep: Which messages to keep besides journals.

    Raises:
        FlightFileError: If the file cannot be created.
        SettingsError: If the flight's settings do not fit this version.
    """
    settings, _ = settings_of(recording)
    place = {
        "directory": target.parent,
        "file_name": target.name,
        "rotate_mb": 0.0,
        "rotate_s": 0.0,
        "pre_trigger_s": 0.0,
    }
    recorder = settings.recorder.model_copy(update=place)
    file = MessageFile(settings.model_copy(update={"recorder": recorder}))
    for stored in recording.stored:
        if begin_ns <= stored.logged_at_ns <= end_ns and (stored.topic is topics.JOURNAL or keep(stored)):
            for message in _of_its_time(stored.message(), begin_ns):
                file.add(stored.topic, message, stored.logged_at_ns)
                if isinstance(message, FrameHeader):
                    _add_picture(file, recording, message, stored)
    file.finish()


def _add_picture(file: MessageFile, recording: ReplayRecording, header: FrameHeader, stored: StoredMessage) -> None:
    picture = recording.pictures.stored(header.captured_at_ns)
    if picture is not None:
        file.add_picture(stored.topic, header, picture, stored.logged_at_ns)


def _of_its_time(message: Message, begin_ns: int) -> Iterator[Message]:
    """The message; of a journal what was given from the beginning on, as if the node had begun then."""
    if not isinstance(message, Journal):
        yield message
        return
    entries = tuple(entry for entry in message.entries if entry.now_ns >= begin_ns)
    if entries:
        yield message.model_copy(update={"started_at_ns": max(message.started_at_ns, begin_ns), "entries": entries})
