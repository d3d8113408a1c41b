"""Looking for the board in pictures, while somebody watches the coverage grow."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from station.calibrate.board import CalibrationBoard, Grey
from station.calibrate.coverage import Coverage
from station.calibrate.gathering import Gathering
from station.calibrate.views import View, find_views

Looked = tuple[Sequence[View], int, tuple[int, int]]
"""Views, how many pictures there were, and their size."""

_SHOW_EVERY = 5


class InputError(ValueError):
    """Pictures that cannot be used, in one line."""


def look_at_all(board: CalibrationBoard, pictures: Iterator[tuple[str, Grey]], coverage_file: Path) -> Looked:
    """Look at every picture. The coverage's picture is renewed all the time.

    Raises:
        InputError: If there is no picture, or their sizes differ.
        OSError: If the coverage cannot be written.
    """
    sizes: dict[tuple[int, int], str] = {}

    def of_one_size() -> Iterator[tuple[str, Grey]]:
        for name, picture in pictures:
            sizes.setdefault((picture.shape[1], picture.shape[0]), name)
            if len(sizes) > 1:
                (first, other), (one, two) = sizes.values(), ("x".join(map(str, size)) for size in sizes)
                raise InputError(f"{first} is {one}, {other} is {two}: a calibration holds for one size of picture")
            yield name, picture

    views: list[View] = []
    seen = Coverage((1, 1))
    count = 0
    for count, (name, view) in enumerate(find_views(board, of_one_size()), 1):
        if count == 1:
            seen = Coverage(next(iter(sizes)))
        print(
            f"{name}: {'no board' if view is None else f'{len(view.corners.pixels)} corners, blur {view.blur_px:.1f} px'}"
        )
        if view is not None:
            views.append(view)
            seen.add([view])
        if count % _SHOW_EVERY == 0:
            seen.draw(coverage_file)
    if not sizes:
        raise InputError("no picture could be decoded")
    return views, count, next(iter(sizes))


def look_live(board: CalibrationBoard, pictures: Iterator[tuple[str, Grey]], coverage_file: Path) -> Looked:
    """Look until a calibration would be accepted, the pictures end, or somebody presses Ctrl-C.

    The coverage's picture lies over what the camera sees, and each line says what is still missing.

    Raises:
        InputError: If no picture came, or their sizes differ.
        OSError: If the coverage cannot be written.
    """
    gathering: Gathering | None = None
    said = ""
    print(f"watch {coverage_file}: hold the board where it is not green, still for a moment; near and far, and tilted")
    try:
        for name, picture in pictures:
            size_px = (picture.shape[1], picture.shape[0])
            gathering = gathering or Gathering(size_px)
            if size_px != gathering.size_px:
                raise InputError(f"{name} has another size than those before: a calibration holds for one size")
            said = _shown(gathering, board, name, picture, coverage_file, said)
            if gathering.enough:
                break
    except KeyboardInterrupt:
        print("ended by hand")
    if gathering is None:
        raise InputError("live: no picture came")
    return gathering.views, gathering.pictures, gathering.size_px


def _shown(
    gathering: Gathering, board: CalibrationBoard, name: str, picture: Grey, coverage_file: Path, said: str
) -> str:
    """Take one picture in and show what came of it; gives what was said last of what is missing."""
    ((_, view),) = find_views(board, [(name, picture)])
    verdict = gathering.take(view)
    gathering.coverage().draw(coverage_file, picture)
    if verdict.kept:
        print(f"{name}: view {len(gathering.views)} ({verdict.why})", flush=True)
    if gathering.missing != said:
        print(f"  next: {gathering.missing}" if gathering.missing else "  enough", flush=True)
    return gathering.missing
