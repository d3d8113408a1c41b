"""`alight replay --update`: lets recordings expect what the nodes say today."""

import sys
from collections.abc import Sequence

from schemas import topics
from station.replay.engine import CHAIN
from station.replay.error import ReplayError
from station.replay.recording import ReplayRecording
from station.replay.replay import replay
from station.replay.rewrite import rewrite
from station.replay.text import result_lines
from station.replay.tolerance import EXACT


def update(recording: ReplayRecording, services: Sequence[str], assignments: Sequence[str], *, unasked: bool) -> int:
    """Show how the replay differs from what is expected, and write it into the recording if a person says yes.

    Args:
        recording: The flight; its file is replaced.
        services: The nodes to replay; by default all whose journals it holds.
        assignments: `section.key=value`, set over the flight's own settings, and written into the recording.
        unasked: Write without asking.

    Returns:
        0 if the recording expects what the nodes say, 1 if it was left as it is.

    Raises:
        ReplayError: If the flight cannot be replayed or rewritten.
        OSError: If the file cannot be written.
    """
    result = replay(recording, services or journalled(recording), assignments, EXACT)
    print(recording.path)
    for line in result_lines(result):
        print(line)
    if result.equal and not assignments and not any(count.uncovered for count in result.counts.values()):
        print("nothing to write: it expects what the nodes say")
        return 0
    if not unasked and not _said_yes(f"write this into {recording.path}? [y/N] "):
        print("left as it is")
        return 1
    rewrite(recording, result, recording.path)
    again = replay(ReplayRecording(recording.path), result.services, (), EXACT)
    if not again.equal:
        raise ReplayError(f"{recording.path}: written, but its replay does not yield it: a node is not deterministic")
    print("written")
    return 0


def journalled(recording: ReplayRecording) -> tuple[str, ...]:
    """The services whose journals a recording holds."""
    senders = {stored.sender for stored in recording.of(topics.JOURNAL)}
    found = tuple(service for service in CHAIN if service in senders)
    if not found:
        raise ReplayError(f"{recording.path}: no journals in it: say which nodes, with --through")
    return found


def _said_yes(question: str) -> bool:
    if not sys.stdin.isatty():
        raise ReplayError("--update asks before it writes: run it on a terminal, or say --yes")
    return input(question).strip().lower() in ("y", "yes")
