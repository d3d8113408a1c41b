"""Ctrl-C as a note that is looked at, instead of an exception out of nowhere.

Python raises KeyboardInterrupt wherever the main thread happens to be, and where that is a finaliser or a callback, it is lost.
Who asks a landing to stop must not have to ask twice.
"""

import contextlib
import signal
import threading
from collections.abc import Iterator


class CtrlC:
    """Whether it was pressed."""

    def __init__(self) -> None:
        self.pressed = False

    def give_way(self) -> None:
        """Go on, if nobody asked to stop.

        Raises:
            KeyboardInterrupt: If somebody did.
        """
        if self.pressed:
            raise KeyboardInterrupt


@contextlib.contextmanager
def ctrl_c_noted() -> Iterator[CtrlC]:
    """While this lasts, Ctrl-C is only noted. Outside the main thread, which alone gets signals, nothing changes."""
    noted = CtrlC()
    if threading.current_thread() is not threading.main_thread():
        yield noted
        return

    def note(*_: object) -> None:
        noted.pressed = True

    before = signal.signal(signal.SIGINT, note)
    try:
        yield noted
    finally:
        signal.signal(signal.SIGINT, before)
