"""The thread that reads a live camera: opens it, reads, and opens it again, patiently, when it is gone."""

import threading
import time
from collections.abc import Callable
from typing import Protocol

from services.camera.capture_stamp import ReadMoment, stamped
from services.camera.live_packet import LivePicture, Picture, Trouble, packed

FIRST_PAUSE_S = 0.2
_JOIN_S = 3.0


class LensError(Exception):
    """A camera that cannot be opened or read now: why, for people."""


class Lens(Protocol):
    """An open camera."""

    def read(self) -> tuple[Picture, float]:
        """The next picture, and the driver's stamp in ms (0 for none); waits for it.

        Raises:
            LensError: If none comes.
        """
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


class Grabber:
    """A port that delivers what a camera sees, newest first in hand: it reads on whatever becomes of the pictures."""

    def __init__(self, open_lens: Callable[[], Lens], *, by_driver: bool, longest_pause_s: float) -> None:
        """Begin nothing yet.

        Args:
            open_lens: Opens the camera, raising `LensError` where it cannot.
            by_driver: Whether the driver's stamps are wanted.
            longest_pause_s: Longest pause between two attempts to open it, seconds.
        """
        self._open_lens = open_lens
        self._by_driver = by_driver
        self._longest_pause_s = longest_pause_s
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def open(self, deliver: Callable[[bytes], None]) -> None:
        """Begin reading in a thread; a camera that is not there yet may come later."""
        self._thread = threading.Thread(target=self._run, args=(deliver,), daemon=True, name="grabber")
        self._thread.start()

    def send(self, data: bytes) -> None:
        """Nothing is sent to a camera."""

    def close(self) -> None:
        """Stop reading."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(_JOIN_S)

    def _run(self, deliver: Callable[[bytes], None]) -> None:
        pause_s = FIRST_PAUSE_S
        while not self._stop.is_set():
            try:
                lens = self._open_lens()
            except LensError as error:
                deliver(packed(Trouble(str(error))))
                self._stop.wait(pause_s)
                pause_s = min(2.0 * pause_s, self._longest_pause_s)
                continue
            try:
                self._read_on(lens, deliver)
            except LensError as error:
                deliver(packed(Trouble(str(error))))
                self._stop.wait(FIRST_PAUSE_S)
            finally:
                lens.close()
            pause_s = FIRST_PAUSE_S

    def _read_on(self, lens: Lens, deliver: Callable[[bytes], None]) -> None:
        while not self._stop.is_set():
            pixels, driver_ms = lens.read()
            read = ReadMoment(time.time_ns(), time.monotonic_ns())
            stamped_at_ns, by_driver = stamped(driver_ms if self._by_driver else 0.0, read)
            deliver(packed(LivePicture(stamped_at_ns, by_driver, pixels)))
