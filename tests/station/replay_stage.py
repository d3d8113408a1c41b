"""A short lockstep flight for the tests of replays, and ways to damage its recording."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from alight.runtime.settings_file import load_settings
from schemas.frame import FrameHeader
from schemas.message import Message
from schemas.topics import Topic
from services.recorder.message_file import MessageFile
from station.director import FlightPlan
from station.lockstep_flight import fly_lockstep
from station.mcap_parts import StoredMessage
from station.replay.aborting_director import AbortingDirector
from station.replay.recorded_settings import settings_of
from station.replay.recording import ReplayRecording
from station.replay.reference import PLAN, SMALL

CHAIN = ("detector", "geolocator", "filter", "commander")
Change = Callable[[StoredMessage], Iterable[Message]]


def fly_short(directory: Path, *assignments: str) -> Path:
    """A descent that is given up after three seconds, with pictures kept without loss; its recording."""
    lossless = ("recorder.frames=png", f"recorder.directory={directory}", "seed=5")
    settings = load_settings(None, {}, [*SMALL, *lossless, *assignments])
    fly_lockstep(settings, PLAN, director=AbortingDirector(settings, PLAN, after_s=3.0))
    return directory / settings.recorder.file_name


def stand_short(directory: Path, *assignments: str) -> Path:
    """A few seconds on the ground above the pad, with every other picture kept, as a lockstep flight does; the recording."""
    small = [assignment for assignment in SMALL if not assignment.startswith(("simulator.airborne", "lockstep."))]
    thinned = ("recorder.frame_rate_hz=0", "lockstep.camera_rate_hz=10", "lockstep.picture_rate_hz=5")
    settings = load_settings(None, {}, [*small, *thinned, f"recorder.directory={directory}", *assignments])
    fly_lockstep(settings, FlightPlan(takeoff_to_ned_m=(0.0, 0.0, -5.0), flight_timeout_s=4.0))
    return directory / settings.recorder.file_name


def altered(
    recording: ReplayRecording, path: Path, change: Change, picture: Callable[[int], bool] = bool
) -> ReplayRecording:
    """The recording once more, each message replaced by what `change` makes of it, and only the pictures that are wanted."""
    settings, _ = settings_of(recording)
    file = MessageFile(
        settings.model_copy(
            update={"recorder": settings.recorder.model_copy(update={"directory": path.parent, "file_name": path.name})}
        )
    )
    for stored in recording.stored:
        for message in change(stored):
            _add(file, recording, stored.topic, message, stored.logged_at_ns, picture)
    file.finish()
    return ReplayRecording(path)


def _add(
    file: MessageFile,
    recording: ReplayRecording,
    topic: Topic[Any],
    message: Message,
    logged_at_ns: int,
    picture: Callable[[int], bool],
) -> None:
    file.add(topic, message, logged_at_ns)
    if isinstance(message, FrameHeader) and picture(message.captured_at_ns):
        data = recording.pictures.stored(message.captured_at_ns)
        assert data is not None
        file.add_picture(topic, message, data, logged_at_ns)
