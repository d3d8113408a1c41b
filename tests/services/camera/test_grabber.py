"""A camera that goes and comes is read whenever it is there."""

import threading
import time
from collections.abc import Callable

import numpy as np

from services.camera.grabber import Grabber, LensError
from services.camera.live_packet import LivePicture, Trouble, unpacked


class Desk:
    """Takes what a grabber delivers."""

    def __init__(self) -> None:
        self.pictures: list[LivePicture] = []
        self.troubles: list[Trouble] = []

    def take(self, data: bytes) -> None:
        what = unpacked(data)
        (self.pictures if isinstance(what, LivePicture) else self.troubles).append(what)  # type: ignore[arg-type]


def wait_for(condition: Callable[[], bool], timeout_s: float = 30.0) -> None:
    deadline_s = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline_s, "it never came about"
        time.sleep(0.02)


class Lens:
    """Gives three pictures, then no more."""

    def __init__(self) -> None:
        self.left = 3
        self.closed = False

    def read(self):
        if self.left == 0:
            raise LensError("unplugged")
        self.left -= 1
        return np.zeros((2, 2), np.uint8), 0.0

    def close(self) -> None:
        self.closed = True


def test_a_camera_that_is_unplugged_and_plugged_in_again_goes_on() -> None:
    lenses: list[Lens] = []
    tried = threading.Event()

    def open_lens() -> Lens:
        if len(lenses) == 1 and not tried.is_set():
            tried.set()
            raise LensError("not there")
        lenses.append(Lens())
        return lenses[-1]

    desk = Desk()
    grabber = Grabber(open_lens, by_driver=False, longest_pause_s=0.2)
    grabber.open(desk.take)
    wait_for(lambda: len(desk.pictures) >= 9)
    grabber.close()
    assert {"unplugged", "not there"} <= {trouble.text for trouble in desk.troubles}
    assert all(lens.closed for lens in lenses)
