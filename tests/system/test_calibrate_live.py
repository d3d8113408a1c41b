"""`alight calibrate camera live`: frames that are published on the bus become a calibration."""

import threading
import time
from pathlib import Path

import pytest

from alight.runtime.bus import Bus
from schemas import topics
from schemas.frame import FrameHeader
from schemas.settings import Settings
from schemas.settings.bus import BusSettings
from schemas.wire import encode
from services.camera.calibration_file import read_calibration
from station.__main__ import main
from station.calibrate.spiral import spiral_pictures

pytestmark = pytest.mark.system

ENDPOINT = "tcp/127.0.0.1:17463"


class Camera(threading.Thread):
    """Publishes the simulated spiral flight over the chessboard, some pictures from each place, again and again."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.ended = threading.Event()

    def run(self) -> None:
        bus = Bus(Settings().vehicle, BusSettings(connect=(ENDPOINT,)))
        sequence = 0
        pictures = [picture for _, picture in spiral_pictures(Settings())]
        while not self.ended.is_set():
            picture = pictures[sequence // 6 % len(pictures)]
            height, width = picture.shape
            header = FrameHeader(
                captured_at_ns=time.time_ns(), sequence=sequence, width_px=width, height_px=height, source="test"
            )
            bus.publish(topics.FRAME, "camera", encode(topics.FRAME, header, picture.tobytes()))
            sequence += 1
            self.ended.wait(0.05)
        bus.close()


@pytest.fixture
def camera():
    thread = Camera()
    thread.start()
    yield thread
    thread.ended.set()
    thread.join(10.0)


def words(out: Path, *more: str) -> list[str]:
    places = [f'bus.connect=["{ENDPOINT}"]', f"vehicle={Settings().vehicle}"]
    sets = [word for key in places for word in ("--set", key)]
    return ["calibrate", "camera", "live", "--board", "chessboard:9x6:0.20", "--out", str(out), *sets, *more]


def test_frames_on_the_bus_become_a_calibration(camera, tmp_path, capsys) -> None:
    assert main(words(tmp_path / "out", "--seconds", "240")) == 0, capsys.readouterr()
    calibration = read_calibration(tmp_path / "out" / "calibration.toml", "test")
    true = Settings().camera.calibration
    assert calibration.fx_px == pytest.approx(true.fx_px, rel=0.01)
    assert calibration.cx_px == pytest.approx(true.cx_px, abs=3.0)
    assert (tmp_path / "out" / "coverage.png").exists()
    assert "enough" in capsys.readouterr().out


def test_a_camera_that_cannot_be_opened_here_is_named(tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setattr("station.calibrate.live.SILENT_S", 1.0)
    own = ["--set", "camera.source=device", "--set", "camera.live.device=/dev/video99"]
    assert main(words(tmp_path / "out", *own)) == 2
    said = capsys.readouterr().err
    assert "no frame within 1 s: /dev/video99 cannot be opened" in said


def test_without_a_camera_one_line_says_what_to_do(tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setattr("station.calibrate.live.SILENT_S", 0.5)
    assert main(words(tmp_path / "out")) == 2
    said = capsys.readouterr().err
    assert "no frame within 0.5 s: start the camera" in said
    assert said.count("\n") == 1
