"""What a node may have been given, where no journal tells: the recorded messages in the order in which they were logged."""

from schemas import topics
from schemas.journal import EntryKind, JournalEntry
from schemas.message import Traced
from schemas.topics import Topic
from station.replay.error import ReplayError
from station.replay.life import Life
from station.replay.recording import ReplayRecording

LATEST_NS = 2**63 - 1


def guessed_life(recording: ReplayRecording, service: str, tick_period_ns: int | None) -> Life:
    """One life of a service, each message at the time at which the recorder had it, or, where an output tells, the service.

    Args:
        recording: The flight.
        service: The service.
        tick_period_ns: How often its node is told the time, nanoseconds; None for never.

    Raises:
        ReplayError: For the commander: what the autopilot told it stands in its journal alone.
    """
    if service == "commander":
        raise ReplayError(
            f"{recording.path}: there is no journal of the commander, and with it the autopilot's bytes: "
            "replay it --through detector,geolocator,filter"
        )
    told = _times_told(recording, service)
    entries = [
        _entry(
            stored.topic.name, stored.stamp_ns, *told.get(stored.stamp_ns, (stored.logged_at_ns, stored.logged_at_ns))
        )
        if _may_tell(stored.topic)
        else _entry(stored.topic.name, stored.stamp_ns, stored.logged_at_ns, stored.logged_at_ns)
        for topic in topics.read_by(service)
        for stored in recording.of(topic)
    ]
    entries += _ticks(recording, service, tick_period_ns)
    entries.sort(key=lambda entry: entry.now_ns)
    remark = (
        f"no journal of the {service}: it is given the messages in the order of their logging, "
        "so the replay is not exact where that was not its own order"
    )
    return Life(service, None, tuple(entries), ((0, LATEST_NS),), False, (remark,))


def _ticks(recording: ReplayRecording, service: str, period_ns: int | None) -> list[JournalEntry]:
    """Those that made the service speak, by what it said then; where nothing tells, one in each period."""
    if period_ns is None:
        return []
    spoken_ns = {
        stored.stamp_ns
        for topic in topics.published_by(service)
        if topic not in (topics.HEALTH, topics.JOURNAL) and not issubclass(topic.message, Traced)
        for stored in recording.of(topic)
    }
    begin_ns = min((stored.logged_at_ns for stored in recording.stored), default=0)
    times_ns = sorted(spoken_ns) or range(begin_ns, recording.ended_at_ns, period_ns)
    return [JournalEntry(kind=EntryKind.TICK, received_at_ns=at_ns, now_ns=at_ns) for at_ns in times_ns]


def _may_tell(topic: Topic[Traced]) -> bool:
    return issubclass(topic.message, Traced)


def _times_told(recording: ReplayRecording, service: str) -> dict[int, tuple[int, int]]:
    """When the service received and handled the input of each capture, by the hops of its outputs, UTC ns."""
    times = {}
    for topic in topics.published_by(service):
        if not issubclass(topic.message, Traced):
            continue
        for stored in recording.of(topic):
            message = recording.message(topic, stored.stamp_ns)
            if isinstance(message, Traced) and message.hops and message.hops[-1].service == service:
                hop = message.hops[-1]
                times[message.captured_at_ns] = (hop.received_at_ns, hop.handled_at_ns)
    return times


def _entry(source: str, stamp_ns: int, received_at_ns: int, now_ns: int) -> JournalEntry:
    return JournalEntry(
        kind=EntryKind.MESSAGE, source=source, stamp_ns=stamp_ns, received_at_ns=received_at_ns, now_ns=now_ns
    )
