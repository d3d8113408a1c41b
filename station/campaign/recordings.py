"""Recordings of the flights worth looking at: flown once more, which gives the same flight, with the recorder in place."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from station.campaign.crew import Crew
from station.campaign.flight_task import FlightTask
from station.campaign.row import Row
from station.campaign.spec import Keep

FOLDER = "flights"


@dataclass(frozen=True)
class Kept:
    """A flight that was flown once more."""

    index: int
    path: Path
    """Its folder."""
    same: bool
    """Whether it went as it did the first time."""


def worth_keeping(rows: Iterable[Row], keep: Keep) -> tuple[int, ...]:
    """Indices of the landed flights with the largest errors at touchdown, worst first, then of the first failed ones."""
    ordered = sorted(rows, key=lambda row: int(row["index"]))
    landed = [row for row in ordered if row["landed"] and row["touchdown_error_m"] is not None]
    worst = sorted(landed, key=lambda row: -float(row["touchdown_error_m"]))[: keep.worst]
    failed = [row for row in ordered if not row["landed"]][: keep.failed]
    return tuple(int(row["index"]) for row in (*worst, *failed))


def folder_of(out: Path, index: int) -> Path:
    """Where the recording of a flight lies."""
    return out / FOLDER / f"{index:06d}"


def make_recordings(
    indices: Sequence[int], tasks: Mapping[int, FlightTask], rows: Mapping[int, Row], out: Path, crew: Crew
) -> Iterator[Kept]:
    """Fly the flights that have no recording yet once more.

    A flight that crashes or hangs leaves what was recorded until then.
    """
    missing = [index for index in indices if not folder_of(out, index).exists()]
    again = (tasks[index].model_copy(update={"record_in": str(_unfinished(out, index))}) for index in missing)
    for flown in crew.fly(again):
        index = int(flown.row["index"])
        unfinished, path = _unfinished(out, index), folder_of(out, index)
        if unfinished.exists():
            unfinished.rename(path)
            yield Kept(index, path, same=flown.row == rows[index])


def _unfinished(out: Path, index: int) -> Path:
    return folder_of(out, index).with_suffix(".unfinished")
