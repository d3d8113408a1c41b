"""The table that `alight detect` prints: a line for each image, and one for a whole video."""

from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path
from typing import Protocol

from services.detector.detector import FoundMarker

_WIDTH = 44
_MOST_IDS = 8


class Seen(Protocol):
    """What the table needs of one picture."""

    @property
    def file(self) -> Path:
        """Where it is from."""
        ...

    @property
    def frame(self) -> int | None:
        """Its number in a video."""
        ...

    @property
    def markers(self) -> tuple[FoundMarker, ...]:
        """What was found."""
        ...

    @property
    def milliseconds(self) -> float:
        """How long it took."""
        ...


def table_lines(seen: Iterable[Seen]) -> Iterator[str]:
    """The lines, each as soon as it is known."""
    yield f"{'file':<{_WIDTH}}  {'markers':>7}  {'ms':>7}  ids"
    for file, group in groupby(seen, key=lambda each: each.file):
        pictures = list(group)
        ids = Counter(marker.id for picture in pictures for marker in picture.markers)
        took_ms = sum(picture.milliseconds for picture in pictures) / len(pictures)
        line = f"{_shortened(file):<{_WIDTH}}  {ids.total():>7}  {took_ms:>7.1f}  {_listed(ids)}"
        if pictures[0].frame is not None:
            hits = sum(bool(picture.markers) for picture in pictures)
            line += f" ({hits} of {len(pictures)} frames)"
        yield line


def _shortened(file: Path) -> str:
    text = str(file)
    return text if len(text) <= _WIDTH else "..." + text[-_WIDTH + 3 :]


def _listed(ids: Counter[int]) -> str:
    if not ids:
        return "-"
    names = [f"{number} x{count}" if count > 1 else str(number) for number, count in sorted(ids.items())]
    more = f" and {len(names) - _MOST_IDS} more" if len(names) > _MOST_IDS else ""
    return ", ".join(names[:_MOST_IDS]) + more
