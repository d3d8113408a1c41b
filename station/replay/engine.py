"""Feeds the chosen nodes exactly what their journals say, and compares what they say with what they said in flight.

Nodes are run in the order of the times that they were told in flight. Where the publisher of an input is itself replayed,
the node waits for the replayed message and is given that one. A message that was published only in the replay reaches its
readers after the recorded median latency; one that was published only in flight reaches nobody.
"""

import gc
import time
from base64 import b64decode
from collections import Counter, defaultdict, deque
from collections.abc import Mapping, Sequence
from itertools import zip_longest

from alight.runtime.clock import NS_PER_S, seconds
from alight.runtime.node import Arrival, Publication
from alight.runtime.node import Outputs as NodeOutputs
from schemas import topics
from schemas.journal import EntryKind, JournalEntry
from schemas.message import Hop, Message, Traced
from schemas.settings import Settings
from station.mcap_parts import StoredMessage
from station.replay.comparison import FieldDifference, differences, recorded_text
from station.replay.cursor import Cursor
from station.replay.latencies import median_latencies_ns
from station.replay.life import Life
from station.replay.listening import Listening
from station.replay.recording import ReplayRecording
from station.replay.result import Given, Input, Origin, Output, ReplayResult, empty_counts
from station.replay.tolerance import Tolerances

CHAIN = ("detector", "geolocator", "filter", "commander")
"""The services that can be replayed, causes first."""
SKEW_NS = NS_PER_S
"""Services on other hosts keep other clocks: a message is waited for until its publisher is this far ahead."""
NOT_COMPARED = frozenset({topics.HEALTH.name, topics.JOURNAL.name})
"""How a process fares is not decided by its node alone."""


class Engine:
    """One replay."""

    def __init__(
        self,
        recording: ReplayRecording,
        settings: Settings,
        lives: Mapping[str, Sequence[Life]],
        tolerances: Tolerances,
    ) -> None:
        """Build the nodes.

        Args:
            recording: The flight.
            settings: What the nodes are built with.
            lives: The services to replay, and what each was given.
            tolerances: For the comparison.

        Raises:
            ValueError: If the settings are at fault.
        """
        services = tuple(service for service in CHAIN if service in lives)
        self._recording = recording
        self._tolerances = tolerances
        self._lives = lives
        self._cursors = {name: Cursor(name, rank, lives[name], settings) for rank, name in enumerate(services)}
        self._published = {name: _compared_topics(name) for name in services}
        self._publisher = {topic: name for name, published in self._published.items() for topic in published}
        self._made: defaultdict[tuple[str, int], list[tuple[Message, Origin]]] = defaultdict(list)
        self._spoken: Counter[tuple[str, int]] = Counter()
        self._listening = Listening(recording, lives)
        self._latency_ns = median_latencies_ns(recording, lives, settings)
        self.result = ReplayResult(services, settings, tolerances.name, counts=empty_counts(self._published))

    def run(self) -> ReplayResult:
        """Replay from the first entry to the last."""
        began_s = time.perf_counter()
        # All that comes to be here stays: looking through it for garbage takes a quarter of the time.
        gc.disable()
        try:
            while (cursor := self._next()) is not None:
                self._step(cursor)
        finally:
            gc.enable()
        self.result.took_s = time.perf_counter() - began_s
        self._conclude()
        return self.result

    def _next(self) -> Cursor | None:
        """Whose turn it is: of those that need not wait for another the one with the earliest entry."""
        waiting: list[tuple[int, int, Cursor, JournalEntry]] = []
        for cursor in self._cursors.values():
            entry = cursor.peek()
            if entry is not None:
                waiting.append((entry.now_ns, cursor.rank, cursor, entry))
        waiting.sort(key=lambda each: each[:2])
        for _, _, cursor, entry in waiting:
            if not self._has_to_wait(entry):
                return cursor
        return waiting[0][2] if waiting else None

    def _has_to_wait(self, entry: JournalEntry) -> bool:
        publisher = self._publisher.get(entry.source) if entry.kind is EntryKind.MESSAGE else None
        if publisher is None or (entry.source, entry.stamp_ns) in self._made:
            return False
        ahead = self._cursors[publisher].peek()
        return ahead is not None and ahead.now_ns <= entry.now_ns + SKEW_NS

    def _step(self, cursor: Cursor) -> None:
        entry, number = cursor.take()
        if entry.kind is EntryKind.MESSAGE:
            # Without a journal a node is guessed to be given all that its service may read; what it does not want it never got.
            if topics.BY_NAME.get(entry.source) in cursor.node.subscriptions:
                self._give_message(cursor, entry, number)
        elif entry.kind is EntryKind.TICK:
            cursor.note(entry, Origin.RECORDED)
            self._collect(cursor, entry, cursor.node.on_tick(entry.now_ns))
        else:
            cursor.note(entry, Origin.RECORDED)
            self._collect(cursor, entry, cursor.node.on_bytes(entry.source, b64decode(entry.data), entry.now_ns))

    def _give_message(self, cursor: Cursor, entry: JournalEntry, number: int) -> None:
        found = self._input(entry, number)
        if found is None:
            if entry.source not in self._publisher:
                self._stand_in(cursor, entry)
            return
        message, origin = found
        topic = topics.BY_NAME[entry.source]
        pixels = self._recording.picture(entry.stamp_ns) if topic.has_pixels else None
        if topic.has_pixels and pixels is None:
            self._stand_in(cursor, entry)
            self._give_unseen(cursor, Arrival(topic, message, entry.received_at_ns, entry.now_ns))
            return
        if origin is Origin.ADDITIONAL and not cursor.admits(entry):
            return
        cursor.note(entry, origin)
        arrival = Arrival(topic, message, entry.received_at_ns, entry.now_ns, pixels)
        self._collect(cursor, entry, cursor.node.on_message(arrival))

    def _input(self, entry: JournalEntry, number: int) -> tuple[Message, Origin] | None:
        if entry.source in self._publisher:
            made = self._made.get((entry.source, entry.stamp_ns), [])
            return made[min(number, len(made) - 1)] if made else None
        topic = topics.BY_NAME.get(entry.source)
        if topic is None:
            return None
        message = self._recording.message(topic, entry.stamp_ns, number)
        return None if message is None else (message, Origin.RECORDED)

    def _stand_in(self, cursor: Cursor, entry: JournalEntry) -> None:
        """What caused them is not in the recording: the recorded outputs of this capture take the replayed ones' place."""
        cursor.note(entry, Origin.STAND_IN)
        self.result.absent["camera/frame/image" if entry.source == topics.FRAME.name else entry.source] += 1
        for name in self._published[cursor.service]:
            topic = topics.BY_NAME[name]
            message = self._recording.message(topic, entry.stamp_ns)
            if isinstance(message, Traced) and message.stamp_ns == message.captured_at_ns:
                self._made[name, entry.stamp_ns].append((message, Origin.STAND_IN))
                self._spoken[name, entry.stamp_ns] += 1
                self.result.stand_ins.append((name, entry.stamp_ns))
                self.result.counts[name].add(Origin.STAND_IN)

    def _give_unseen(self, cursor: Cursor, arrival: Arrival[Message]) -> None:
        """Give a node the frame without its picture, and take nothing of what it says: the recorded outputs stand in.

        So it knows when it last looked, as it did in flight; a detector rests on the ground by that.
        """
        try:
            deque(cursor.node.on_message(arrival), maxlen=0)
        except Exception as error:
            cursor.failures[f"{type(error).__name__}: {error}"] += 1

    def _collect(self, cursor: Cursor, entry: JournalEntry, outputs: NodeOutputs) -> None:
        try:
            published = [output for output in outputs if isinstance(output, Publication)]
        except Exception as error:  # a live service goes on after a bug in its node, and so does its replay
            cursor.failures[f"{type(error).__name__}: {error}"] += 1
            return
        for publication in published:
            if publication.topic.name not in NOT_COMPARED:
                self._take(cursor, entry, publication)

    def _take(self, cursor: Cursor, entry: JournalEntry, publication: Publication) -> None:
        topic = publication.topic
        lane = (topic.name, publication.message.stamp_ns)
        number = self._spoken[lane]
        stored = self._recording.find(topic, lane[1], number)
        self._spoken[lane] += 1
        leaves_ns = entry.now_ns + self._latency_ns.of_service(cursor.service)
        message, found = self._compared(cursor.service, publication.message, entry, stored, number, leaves_ns)
        output = Output(
            service=cursor.service,
            topic=topic.name,
            message=message,
            entry=entry,
            recorded=stored is not None,
            logged_at_ns=leaves_ns if stored is None else stored.logged_at_ns,
            differences=found,
            inputs=_inputs(cursor) if found or stored is None else (),
            exact_input=cursor.life is not None and cursor.life.exact and not cursor.lacked,
            heard=self._listening.heard(topic, leaves_ns),
        )
        self.result.outputs.append(output)
        self._made[lane].append((message, output.origin))
        if stored is None:
            self._forward(output)

    def _compared(
        self,
        service: str,
        message: Message,
        entry: JournalEntry,
        stored: StoredMessage | None,
        number: int,
        leaves_ns: int,
    ) -> tuple[Message, tuple[FieldDifference, ...]]:
        """The message as it leaves, and how it differs from the recorded one."""
        if stored is None:
            return _stamped(service, message, entry, None, leaves_ns), ()
        if not isinstance(message, Traced) and recorded_text(message) == stored.data:
            return message, ()  # quicker than reading what is recorded
        recorded = self._recording.message(stored.topic, stored.stamp_ns, number)
        stamped = _stamped(service, message, entry, recorded, leaves_ns)
        found = () if recorded is None else differences(recorded, stamped, self._tolerances)
        if self._recording.older:
            found = tuple(difference for difference in found if difference.recorded is not None)
        return stamped, found

    def _forward(self, output: Output) -> None:
        """Bring a message that there was not in flight to its readers."""
        stamp_ns = output.message.stamp_ns
        for cursor in self._cursors.values():
            if topics.BY_NAME[output.topic] in cursor.node.subscriptions:
                now_ns = output.entry.now_ns + self._latency_ns.between(output.topic, output.service, cursor.service)
                cursor.add(
                    JournalEntry(
                        kind=EntryKind.MESSAGE,
                        source=output.topic,
                        stamp_ns=stamp_ns,
                        received_at_ns=now_ns,
                        now_ns=now_ns,
                    )
                )

    def _conclude(self) -> None:
        result = self.result
        for output in result.outputs:
            result.counts[output.topic].add(output.origin)
        for service, published in self._published.items():
            for name in published:
                self._find_missing(service, name)
        for cursor in self._cursors.values():
            result.given[cursor.service] = self._given(cursor)
            result.remarks += [remark for life in self._lives[cursor.service] for remark in life.remarks]
            for failure, times in cursor.failures.items():
                result.remarks.append(f"the {cursor.service}'s node failed {times} times: {failure}")
        times_ns = [e.now_ns for lives in result.given.values() for life in lives for e in life.entries]
        result.flown_s = seconds(max(times_ns) - min(times_ns)) if times_ns else 0.0

    def _given(self, cursor: Cursor) -> list[Given]:
        found = []
        for entries, life in zip_longest(cursor.given, self._lives[cursor.service]):
            if not entries:
                continue
            first_ns, last_ns = entries[0].now_ns, entries[-1].now_ns
            ended_at_ns = min(life.spans_ns[-1][1], self._recording.ended_at_ns) if life else last_ns
            found.append(Given((life and life.started_at_ns) or first_ns, entries, max(ended_at_ns, last_ns)))
        return found

    def _find_missing(self, service: str, name: str) -> None:
        topic = topics.BY_NAME[name]
        seen: Counter[int] = Counter()
        for stored in self._recording.of(topic):
            seen[stored.stamp_ns] += 1
            if seen[stored.stamp_ns] <= self._spoken[name, stored.stamp_ns]:
                continue
            if any(life.covers(stored.logged_at_ns) for life in self._lives[service]):
                self.result.counts[name].missing += 1
                self.result.missing.append(stored)
            else:
                self.result.counts[name].uncovered += 1


def _compared_topics(service: str) -> tuple[str, ...]:
    return tuple(topic.name for topic in topics.published_by(service) if topic.name not in NOT_COMPARED)


def _inputs(cursor: Cursor) -> tuple[Input, ...]:
    return tuple(Input(topic, stamp_ns, origin) for topic, (stamp_ns, origin) in sorted(cursor.newest.items()))


def _stamped(service: str, message: Message, entry: JournalEntry, recorded: Message | None, leaves_ns: int) -> Message:
    """The message with the service's hop, as the runtime stamps it.

    When it left is not the node's doing: that is taken from the recorded message, if there is one.
    """
    if not isinstance(message, Traced):
        return message
    if isinstance(recorded, Traced) and recorded.hops:
        left = recorded.hops[-1]
        if entry.kind is not EntryKind.MESSAGE:
            return message.with_hop(left)
        leaves_ns = left.published_at_ns
    elif entry.kind is not EntryKind.MESSAGE:
        leaves_ns = entry.now_ns
    return message.with_hop(
        Hop(
            service=service,
            received_at_ns=min(entry.received_at_ns, leaves_ns),
            handled_at_ns=min(entry.now_ns, leaves_ns),
            published_at_ns=leaves_ns,
        )
    )
