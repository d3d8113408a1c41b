"""`alight detect` on pictures made here, and on real ones where they lie beside the repository."""

import argparse
import json
import os
from collections import Counter
from pathlib import Path

import cv2
import numpy as np
import pytest

from alight.markers.family import dictionary
from station import detect

REAL = Path(os.environ.get("ALIGHT_REAL_DATA", Path(__file__).resolve().parents[2].parent / "shared" / "real"))
needs_real_data = pytest.mark.skipif(not REAL.is_dir(), reason="no real pictures here (ALIGHT_REAL_DATA)")


def run(*words: object) -> int:
    parser = argparse.ArgumentParser()
    detect.add_arguments(parser)
    return detect.run(parser.parse_args([str(word) for word in words]))


def looked(capsys, *words: object) -> list[dict]:
    assert run(*words, "--json") == 0
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    """Marker 68, 140 pixels wide, its upper left corner at (99.5, 49.5)."""
    canvas = np.full((240, 320), 220, np.uint8)
    canvas[50:190, 100:240] = cv2.aruco.generateImageMarker(dictionary("5x5_1000"), 68, 140)
    path = tmp_path / "pad.png"
    cv2.imwrite(str(path), canvas)
    return path


@pytest.fixture
def lens(tmp_path: Path) -> Path:
    path = tmp_path / "lens.toml"
    path.write_text("width_px=320\nheight_px=240\nfx_px=280.0\nfy_px=280.0\ncx_px=159.5\ncy_px=119.5\n")
    return path


def test_json_has_name_corners_and_time_and_no_poses_without_a_camera(capsys, picture) -> None:
    (line,) = looked(capsys, picture)
    assert line["name"] == str(picture)
    assert line["milliseconds"] > 0.0
    (marker,) = line["detections"]
    assert (marker["family"], marker["id"], marker["poses"]) == ("5x5_1000", 68, [])
    assert np.allclose(marker["corners_px"], [[99.5, 49.5], [239.5, 49.5], [239.5, 189.5], [99.5, 189.5]], atol=0.05)


def test_with_a_camera_there_are_poses_at_the_size_given(capsys, picture, lens) -> None:
    (line,) = looked(capsys, picture, "--camera", lens, "--size-m", "0.5")
    pose = line["detections"][0]["poses"][0]
    assert pose["position_camera_m"] == pytest.approx([10.0 / 280.0, 0.0, 1.0], abs=0.002)


def test_only_the_wanted_id_is_told(capsys, picture) -> None:
    assert looked(capsys, picture, "--id", 67)[0]["detections"] == []


def test_the_table_and_the_drawing_are_for_people(capsys, picture, tmp_path) -> None:
    assert run(picture, "--draw", tmp_path / "drawn") == 0
    out = capsys.readouterr().out
    assert "pad.png" in out
    assert "no poses: they need the camera's calibration" in out
    assert cv2.imread(str(tmp_path / "drawn" / "pad.png")).shape == (240, 320, 3)


def test_a_mirror_image_is_only_read_when_flipped(capsys, picture) -> None:
    cv2.imwrite(str(picture), cv2.flip(cv2.imread(str(picture)), 1))
    assert looked(capsys, picture)[0]["detections"] == []
    assert len(looked(capsys, picture, "--mirrored")[0]["detections"]) == 1


def test_what_cannot_be_decoded_is_named_and_the_rest_is_done(capsys, picture, tmp_path) -> None:
    broken = tmp_path / "broken.jpg"
    broken.write_bytes(b"nothing")
    assert run(broken, picture, "--json") == 1
    captured = capsys.readouterr()
    assert len(captured.out.splitlines()) == 1
    assert captured.err == f"alight detect: {broken}: not an image or video that can be decoded\n"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["missing.png"], "missing.png: no such image"),
        (["{picture}", "--family", "5x5"], "no marker family '5x5'"),
        (["{picture}", "--id", "1", "--detector", "yolo"], "detector.yolo.model: names no model: "),
        (["{picture}", "--id", "1", "--detector", "yolo", "--model", "nowhere.onnx"], "no file nowhere.onnx: "),
        (["{picture}", "--detector", "foo"], "--detector: no detector 'foo': there are: aided, "),
        (["{picture}", "--detector", "foo", "--dictionary", "mine.yml"], "--detector: no detector 'foo': there are: "),
        (["{picture}", "--camera", "{picture}"], "pad.png: cannot be read (not a text file): correct --camera"),
        (
            ["{picture}", "--camera", "missing.yaml"],
            "missing.yaml: cannot be read (No such file or directory): correct",
        ),
        (["{picture}", "--family", "5x5_50", "--detector", "apriltag"], "reads apriltag_16h5,"),
        (
            ["{picture}", "--camera", "missing.toml"],
            "missing.toml: cannot be read (No such file or directory): correct --camera",
        ),
    ],
)
def test_options_that_cannot_be_used_give_one_line(capsys, picture, words, says) -> None:
    assert run(*[word.format(picture=picture) for word in words]) == 2
    err = capsys.readouterr().err
    assert says in err
    assert err.count("\n") == 1


def test_a_camera_for_another_size_gives_corners_and_says_why_there_are_no_poses(capsys, picture, tmp_path) -> None:
    lens = tmp_path / "other.toml"
    lens.write_text("width_px=640\nheight_px=480\nfx_px=280.0\nfy_px=280.0\ncx_px=320\ncy_px=240\n")
    assert run(picture, "--camera", lens, "--json") == 1
    captured = capsys.readouterr()
    assert len(json.loads(captured.out)["detections"]) == 1
    assert "320x240, but" in captured.err


@pytest.fixture
def tags(tmp_path: Path) -> Path:
    """Two AprilTags, 7 and 12."""
    canvas = np.full((240, 400), 220, np.uint8)
    for number, left in ((7, 40), (12, 240)):
        canvas[60:180, left : left + 120] = cv2.aruco.generateImageMarker(dictionary("apriltag_36h11"), number, 120)
    path = tmp_path / "tags.png"
    cv2.imwrite(str(path), canvas)
    return path


def test_apriltag_reads_all_of_its_family_without_being_told_more(capsys, tags) -> None:
    (line,) = looked(capsys, tags, "--detector", "apriltag")
    assert sorted((marker["family"], marker["id"]) for marker in line["detections"]) == [
        ("apriltag_36h11", 7),
        ("apriltag_36h11", 12),
    ]
    assert looked(capsys, tags, "--detector", "apriltag", "--id", "12")[0]["detections"][0]["id"] == 12


def test_apriltag_and_aruco_give_the_same_corners(capsys, tags) -> None:
    lines = [
        looked(capsys, tags, "--family", "apriltag_36h11", "--detector", name)[0] for name in ("aruco", "apriltag")
    ]
    one, other = ({marker["id"]: marker["corners_px"] for marker in line["detections"]} for line in lines)
    assert one.keys() == other.keys()
    assert all(np.allclose(one[number], other[number], atol=0.1) for number in one)


def ids_in(lines: list[dict]) -> Counter:
    return Counter(marker["id"] for line in lines for marker in line["detections"])


@needs_real_data
@pytest.mark.parametrize(
    ("place", "options", "least", "allowed"),
    [
        ("opencv_aruco_tutorials/singlemarkersoriginal.jpg", ["--family", "6x6_250"], 6, {23, 40, 62, 98, 124, 203}),
        ("opencv_aruco_tutorials/chocclusion_original.jpg", ["--family", "6x6_250"], 13, set(range(17))),
        ("opencv_aruco_tutorials/img_0*.jpg", ["--family", "6x6_250"], 68, set(range(17))),
        ("ubiquity_raspicam/tag_01_d7_14cm.png", [], 1, {1}),
        ("ubiquity_raspicam/403.jpg", [], 1, {403}),
        ("ubiquity_raspicam/aruco_marker.bag.frame.jpg", [], 1, {1}),
        (
            "duckietown_multiple/test_image_multiple_*.png",
            ["--family", "apriltag_36h11"],
            28,
            {22, 24, 58, 85, 144, 198},
        ),
        ("apriltag_upstream/33369213973_9d9bb4cc96_c.jpg", ["--family", "apriltag_36h11"], 13, {0}),
        ("apriltag_upstream/34085369442_304b6bafd9_c.jpg", ["--family", "apriltag_36h11"], 15, {0}),
        ("apriltag_upstream/34139872896_defdb2f8d9_c.jpg", ["--family", "apriltag_36h11"], 14, {0}),
        ("apriltag_upstream", ["--detector", "apriltag"], 46, {0}),
        ("duckietown_multiple/test_image_multiple_*.png", ["--detector", "apriltag"], 29, {22, 24, 58, 85, 144, 198}),
        ("tello_mirror_flight_day/video_2023-07-31_10-14-37.mp4", ["--detector", "apriltag", "--mirrored"], 10, {3}),
        ("tello_mirror_flight_day/video_2023-07-31_10-14-37.mp4", ["--detector", "apriltag"], 0, set()),
        ("tello_mirror_flight_day/stills", ["--detector", "apriltag"], 0, set()),
        ("tello_front_gridboard/[0-9]*.png", ["--family", "6x6_1000"], 235, set(range(35))),
        ("tello_front_gridboard/mirrored_*.png", ["--family", "6x6_1000"], 0, set()),
        ("tello_front_gridboard/mirrored_*.png", ["--family", "6x6_1000", "--mirrored"], 42, set(range(35))),
        ("tello_mirror_flight_day/video_2023-07-31_10-14-37.mp4", ["--family", "apriltag_36h11", "--mirrored"], 9, {3}),
        ("tello_mirror_flight_day/video_2023-07-31_10-14-37.mp4", ["--family", "apriltag_36h11"], 0, set()),
        ("tello_mirror_flight_day/stills", ["--family", "apriltag_36h11", "--mirrored"], 0, set()),
        ("phone_6markers_video/ar.mp4", ["--family", "6x6_250"], 3109, {23, 40, 62, 98, 124, 203}),
        ("phone_6markers_video/ar.mp4", [], 0, set()),
        ("tello_front_gridboard", [], 0, set()),
    ],
)
def test_real_pictures_show_what_is_known_of_them_and_nothing_else(capsys, place, options, least, allowed) -> None:
    seen = ids_in(looked(capsys, REAL / place, *options))
    assert seen.total() >= least
    assert set(seen) <= allowed


@needs_real_data
def test_a_board_of_ones_own_dictionary_is_read(capsys) -> None:
    folder = REAL / "opencv_aruco_tutorials"
    seen = ids_in(looked(capsys, folder / "gboriginal.jpg", "--dictionary", folder / "tutorial_dict.yml"))
    assert seen == Counter(range(35))


@needs_real_data
def test_corners_agree_with_the_regression_corners_of_the_pictures_authors(capsys) -> None:
    (line,) = looked(capsys, REAL / "ubiquity_raspicam" / "tag_01_d7_14cm.png")
    known = [[569.9, 201.6], [777.4, 206.9], [768.0, 415.4], [565.8, 409.2]]
    assert np.abs(np.array(line["detections"][0]["corners_px"]) - known).max() < 0.6
