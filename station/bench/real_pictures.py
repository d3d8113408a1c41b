"""Every real picture that lies beside the repository: what each detector finds there, and what the README says is there."""

import argparse
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from alight.markers.family import dictionary, dictionary_from_file
from alight.markers.layout import PadLayout, PlacedMarker
from alight.runtime.clock import NS_PER_S
from schemas.settings import Settings
from schemas.settings.detector import AprilTag, Aruco
from services.camera.files import VIDEO_SUFFIXES, pictures_in
from services.detector.apriltag import LIBRARY_NAMES, AprilTagBackend
from services.detector.aruco import ArucoBackend
from services.detector.charuco import CharucoBackend
from services.detector.detector import Detector, View
from services.detector.node import grey
from services.detector.registry import detector_from
from station.bench.calibration import REAL
from station.bench.real_sets import SETS, RealSet
from station.bench.table import print_table

NAMES = ("aruco", "apriltag", "charuco", "aided")
_HEAD = ("file", "family", "README", *NAMES, "false")
_FRAME_NS = NS_PER_S // 30


@dataclass(frozen=True)
class Found:
    """What one detector found in one file."""

    markers: int
    """That are there."""
    pictures: int
    """That show one or more."""
    false: tuple[int, ...]
    """Ids that are not there."""


def bench_real_pictures(words: Sequence[str] = ()) -> None:
    """Print the table, a row a file, and how many false ids there were in all."""
    parser = argparse.ArgumentParser(prog="python -m station.bench real-pictures")
    parser.add_argument("--data", type=Path, default=REAL, metavar="DIR", help="default: %(default)s")
    data: Path = parser.parse_args(words).data
    if not data.is_dir():
        print("no real pictures here: name their folder with --data or in ALIGHT_REAL_DATA")
        return
    rows, false = [], 0
    for each in SETS:
        for file in each.files(data):
            found = {name: look(name, each, file) for name in NAMES}
            rows.append(_row(each, file, found))
            false += sum(len(one.false) for one in found.values() if one is not None)
    print_table("Real pictures: markers found, by detector", _HEAD, rows)
    files = {file for each in SETS for file in each.files(data)}
    print(f"{len(files)} files; ids that are not there: {false}")


def look(name: str, each: RealSet, file: Path) -> Found | None:
    """What a detector finds in an image or a video; None if it cannot read such markers."""
    detector = _detector(name, each, file)
    if detector is None:
        return None
    ids: Counter[int] = Counter()
    pictures = 0
    for view in _views(file, mirrored=each.mirrored):
        seen = [marker.id for marker in detector.detect(view)]
        ids.update(seen)
        pictures += bool(each.ids.intersection(seen))
    there = sum(count for number, count in ids.items() if number in each.ids)
    return Found(
        there, pictures, tuple(sorted((ids - Counter({number: ids[number] for number in each.ids})).elements()))
    )


def _views(file: Path, *, mirrored: bool) -> Iterator[View]:
    for number, picture in enumerate(pictures_in(file, mirrored=mirrored), start=1):
        if picture is not None:
            yield View(grey(picture.pixels), number * _FRAME_NS)


def _detector(name: str, each: RealSet, file: Path) -> Detector | None:
    if name == "aruco":
        if each.dictionary:
            return ArucoBackend(dictionary_from_file(file.parent / each.dictionary), each.dictionary, Aruco())
        return ArucoBackend(dictionary(each.family), each.family, Aruco())
    if name == "apriltag" and each.family in LIBRARY_NAMES:
        return AprilTagBackend([each.family], AprilTag())
    if name == "charuco" and each.board is not None:
        places = each.board.marker_places()
        markers = tuple(PlacedMarker(each.family, number, each.board.marker_m, x, y) for number, x, y in places)
        return CharucoBackend(PadLayout(file.name, markers, 1.0, charuco=each.board), Aruco())
    if name == "aided" and not each.dictionary:
        # It looks for one pad: the first of the markers, or, where there is none, any.
        pad = {"family": each.family, "id": min(each.ids, default=3)}
        return detector_from(Settings.model_validate({"pad": pad, "detector": {"backend": "aided"}}))
    return None


def _row(each: RealSet, file: Path, found: dict[str, Found | None]) -> tuple[str, ...]:
    video = file.suffix.lower() in VIDEO_SUFFIXES
    cells = []
    for name in NAMES:
        one = found[name]
        if one is None:
            cells.append("")
        else:
            cells.append(f"{one.markers} in {one.pictures} frames" if video and one.markers else str(one.markers))
    false = {name: one.false for name, one in found.items() if one is not None and one.false}
    label = f"{file.parent.name}/{file.name}" + (" (flipped)" if each.mirrored else "")
    said = "; ".join(f"{name} {', '.join(map(str, ids))}" for name, ids in false.items())
    return (label[-58:], each.dictionary or each.family, each.readme(file), *cells, said or "none")
