"""What a node was given from its start to its end, by its journals."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from alight.runtime.clock import seconds
from schemas.journal import Journal, JournalEntry
from station.replay.recording import ReplayRecording


@dataclass(frozen=True)
class Life:
    """One run of a service's process; one that was started again has several."""

    service: str
    started_at_ns: int | None
    """When the node began, UTC ns; None where no journal tells."""
    entries: tuple[JournalEntry, ...]
    """What it was given, first to last."""
    spans_ns: tuple[tuple[int, int], ...]
    """When what it published was logged, as far as it is known what it was given, UTC ns."""
    exact: bool
    """Whether order, times and bytes are those of the flight, with nothing missing."""
    remarks: tuple[str, ...] = ()
    """What is missing or guessed, in words."""

    def covers(self, logged_at_ns: int) -> bool:
        """Whether what caused an output that was logged at this time, UTC ns, is among the entries."""
        return any(begin_ns <= logged_at_ns <= end_ns for begin_ns, end_ns in self.spans_ns)


def journalled_lives(recording: ReplayRecording, service: str) -> list[Life]:
    """A service's lives by its journals; none if the recording has no journal of it."""
    journals = sorted(
        recording.journals(service), key=lambda logged: (logged[0].started_at_ns, logged[0].number, logged[1])
    )
    return [_life(service, list(group)) for _, group in groupby(journals, key=lambda logged: logged[0].started_at_ns)]


def _life(service: str, journals: Sequence[tuple[Journal, int]]) -> Life:
    entries = tuple(entry for journal, _ in journals for entry in journal.entries)
    spans_ns, remarks = [], []
    expected = 0
    since_ns = journals[0][0].started_at_ns
    for journal, logged_at_ns in journals:
        if journal.number > expected:
            remarks.append(_gap(service, expected, journal))
            since_ns = journal.entries[0].now_ns if journal.entries else logged_at_ns
        spans_ns.append((since_ns, logged_at_ns))
        since_ns, expected = logged_at_ns, journal.number + 1
    return Life(service, journals[0][0].started_at_ns, entries, tuple(spans_ns), not remarks, tuple(remarks))


def _gap(service: str, expected: int, journal: Journal) -> str:
    missing = (
        f"journal {expected}" if journal.number == expected + 1 else f"journals {expected} to {journal.number - 1}"
    )
    after_s = seconds(journal.at_ns - journal.started_at_ns)
    return f"{missing} of the {service} missing (before {after_s:.2f} s after its start): what it was given then is unknown"
