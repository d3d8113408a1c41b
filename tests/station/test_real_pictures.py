"""The bench that counts what is in real pictures, on pictures that are drawn here under the names of real ones."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from alight.markers.family import dictionary
from station.bench.real_pictures import bench_real_pictures, look
from station.bench.real_sets import SETS, RealSet


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A folder with the Raspberry camera's pictures: 403.jpg as it should be, tag_01 with another marker than it should hold."""
    folder = tmp_path / "ubiquity_raspicam"
    folder.mkdir()
    for name, number in (("403.jpg", 403), ("tag_01_d7_14cm.png", 77)):
        canvas = np.full((240, 320), 220, np.uint8)
        canvas[50:190, 100:240] = cv2.aruco.generateImageMarker(dictionary("5x5_1000"), number, 140)
        cv2.imwrite(str(folder / name), canvas)
    return tmp_path


def test_the_table_shows_counts_beside_the_readme_and_names_what_is_not_there(data, capsys) -> None:
    bench_real_pictures(["--data", str(data)])
    right, wrong = (line for line in capsys.readouterr().out.splitlines() if line.startswith("ubiquity_raspicam/"))
    assert right.split() == ["ubiquity_raspicam/403.jpg", "5x5_1000", "1", "1", "1", "none"]
    assert "aruco 77; aided 77" in wrong


def test_false_ids_are_counted_in_all(data, capsys) -> None:
    bench_real_pictures(["--data", str(data)])
    assert capsys.readouterr().out.rstrip().endswith("2 files; ids that are not there: 2")


def test_a_detector_that_cannot_read_a_family_is_left_out(data) -> None:
    (each,) = (one for one in SETS if one.pattern == "ubiquity_raspicam/403.jpg")
    file = data / "ubiquity_raspicam" / "403.jpg"
    assert look("apriltag", each, file) is None
    assert look("charuco", each, file) is None
    assert look("aruco", each, file).markers == 1


def test_a_set_says_what_the_readme_counts_for_each_file(tmp_path) -> None:
    some = RealSet("*", "5x5_1000", frozenset(), {"a": "3", "": "0"})
    assert [some.readme(tmp_path / name) for name in ("a1.png", "b1.png")] == ["3", "0"]


def test_without_the_pictures_it_says_where_to_name_them(tmp_path, capsys) -> None:
    bench_real_pictures(["--data", str(tmp_path / "missing")])
    assert "name their folder with --data" in capsys.readouterr().out
