"""The thread that writes: the node never waits for the disk, and what is given up is counted."""

import threading
from pathlib import Path

import numpy as np

from alight.runtime.clock import LOCKSTEP_EPOCH_NS
from schemas.frame import FrameHeader
from schemas.settings import Settings
from services.recorder.background import BackgroundFile
from services.recorder.entry import Entry, Picture
from services.recorder.flight_file import FlightFile
from services.recorder.host import Host


class StalledFile(FlightFile):
    """A flight's file on a disk that stands still until it is told to go on."""

    def __init__(self, settings: Settings) -> None:
        super().__init__(settings)
        self.goes_on = threading.Event()

    def tick(self, now_ns: int) -> None:
        self.goes_on.wait(30.0)
        super().tick(now_ns)


def message(number: int, size_bytes: int = 1000) -> Entry:
    at_ns = LOCKSTEP_EPOCH_NS + number
    return Entry("truth", b"{" + b" " * size_bytes + b"}", number, at_ns, at_ns, at_ns)


def picture(number: int) -> Entry:
    at_ns = LOCKSTEP_EPOCH_NS + number
    header = FrameHeader(captured_at_ns=at_ns, sequence=number, width_px=64, height_px=48, source="test")
    return Entry("camera/frame/image", Picture(header, np.zeros((48, 64), np.uint8)), number, at_ns, at_ns, at_ns)


def stalled(tmp_path: Path, limit_bytes: int) -> tuple[StalledFile, BackgroundFile]:
    file = StalledFile(Settings.model_validate({"recorder": {"directory": tmp_path}}))
    background = BackgroundFile(file, Host(), limit_bytes)
    background.tick(0)
    return file, background


def test_the_node_does_not_wait_for_a_disk_that_stands_still(tmp_path):
    file, background = stalled(tmp_path, 10**9)
    for number in range(500):
        background.add(message(number))
    assert background.tally.recorded == 0
    file.goes_on.set()
    background.finish()
    assert (background.tally.recorded, background.tally.lost) == (500, 0)


def test_when_too_much_waits_pictures_are_given_up_before_messages(tmp_path):
    file, background = stalled(tmp_path, 40_000)
    for number in range(20):
        background.add(picture(number))
    pictures_lost = background.tally.lost_backlog
    assert pictures_lost == 20 - 9  # 9 of 3072 bytes are not yet three quarters
    for number in range(20):
        background.add(message(number))
    assert background.tally.lost_backlog == pictures_lost + 8
    file.goes_on.set()
    background.finish()
    assert background.tally.recorded == 9 + 12
    assert background.failure is None and background.path == tmp_path / "flight.mcap"


def test_a_bug_in_the_recording_does_not_end_it(tmp_path):
    file, background = stalled(tmp_path, 10**9)
    background.add(Entry("no such channel", b"{}", 0, 0, 0, 0))
    background.add(message(1))
    file.goes_on.set()
    background.finish()
    assert background.tally.recorded == 1
