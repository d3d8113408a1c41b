"""The journal says in which order and when a node was given what."""

from base64 import b64decode
from collections.abc import Iterable

from alight.runtime.clock import VirtualClock
from alight.runtime.journal import MOST_ENTRIES, PERIOD_NS, JournalKeeper
from alight.runtime.node import Arrival, Node, Publication
from schemas import topics
from schemas.journal import EntryKind, Journal
from schemas.mission import MissionRequest, Verb
from schemas.wire import decode, encode


class _Commander(Node):
    service = "commander"


class _Camera(Node):
    service = "camera"


BEGAN_NS = VirtualClock().now_ns()


def request(at_ns: int) -> Arrival[MissionRequest]:
    message = MissionRequest(at_ns=at_ns, request_id="r1", verb=Verb.LAND)
    return Arrival(topics.REQUEST, message, at_ns + 1, at_ns + 2)


def written(publications: Iterable[Publication]) -> list[Journal]:
    return [publication.message for publication in publications if isinstance(publication.message, Journal)]


def test_a_journal_holds_everything_in_the_order_in_which_it_was_given() -> None:
    keeper = JournalKeeper(_Commander(), BEGAN_NS)
    keeper.bytes("vehicle", b"\xfd\x00mavlink", BEGAN_NS + 10)
    keeper.message(request(BEGAN_NS + 20))
    keeper.tick(BEGAN_NS + 30)

    (journal,) = written(keeper.rest(BEGAN_NS + 40))

    assert [entry.kind for entry in journal.entries] == [EntryKind.BYTES, EntryKind.MESSAGE, EntryKind.TICK]
    data, message, tick = journal.entries
    assert (data.source, b64decode(data.data)) == ("vehicle", b"\xfd\x00mavlink")
    assert (message.source, message.stamp_ns) == ("commander/request", BEGAN_NS + 20)
    assert (message.received_at_ns, message.now_ns) == (BEGAN_NS + 21, BEGAN_NS + 22)
    assert tick.now_ns == BEGAN_NS + 30


def test_journals_are_numbered_without_a_gap_and_say_when_the_node_began() -> None:
    keeper = JournalKeeper(_Commander(), BEGAN_NS)
    journals: list[Journal] = []
    for step in range(1, 40):
        now_ns = BEGAN_NS + step * PERIOD_NS // 8
        keeper.tick(now_ns)
        if keeper.is_due(now_ns):
            journals += written(keeper.rest(now_ns))
    journals += written(keeper.rest(BEGAN_NS + 6 * PERIOD_NS))

    assert [journal.number for journal in journals] == list(range(len(journals)))
    assert sum(len(journal.entries) for journal in journals) == 39
    assert {journal.started_at_ns for journal in journals} == {BEGAN_NS}
    assert 4 <= len(journals) <= 6


def test_a_clock_set_back_does_not_silence_it() -> None:
    keeper = JournalKeeper(_Commander(), BEGAN_NS)
    hour_ns = 3600 * 10**9
    keeper.tick(BEGAN_NS - hour_ns)
    assert keeper.is_due(BEGAN_NS - hour_ns)


def test_a_service_that_publishes_none_keeps_none() -> None:
    keeper = JournalKeeper(_Camera(), BEGAN_NS)
    keeper.tick(BEGAN_NS + 1)
    assert not keeper.rest(BEGAN_NS + 2)


def test_what_had_to_wait_long_is_written_in_portions_that_the_wire_takes() -> None:
    keeper = JournalKeeper(_Commander(), BEGAN_NS)
    for step in range(3000):
        keeper.bytes("vehicle", bytes(50), BEGAN_NS + step)
    publications = keeper.rest(BEGAN_NS + 3000)
    journals = written(publications)
    assert [journal.number for journal in journals] == list(range(len(journals)))
    assert sum(len(journal.entries) for journal in journals) == 3000
    for journal in journals:
        wire = encode(topics.JOURNAL, journal)
        assert decode(topics.JOURNAL, wire.payload, None, wire.encoding) == journal


def test_a_flood_is_bounded_and_shows_as_a_gap() -> None:
    keeper = JournalKeeper(_Commander(), BEGAN_NS)
    for step in range(MOST_ENTRIES + 1):
        keeper.tick(BEGAN_NS + step)
    (journal,) = written(keeper.rest(BEGAN_NS + MOST_ENTRIES + 1))
    assert len(journal.entries) == 1
    assert journal.number == 1
