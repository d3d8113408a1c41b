"""Where what arrives waits for the node: filled by receiving threads, emptied by the one that runs the node."""

import contextlib
import queue
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from schemas.topics import Delivery, Topic

CAPACITY = 2000
"""Bound of what may wait. A node that falls this far behind loses newly arriving STATE, and says so, and newly
arriving bytes, as on any radio link."""


class Letter(NamedTuple):
    """A message as it came over the bus, or bytes as they came through a port."""

    received_at_ns: int
    topic: Topic[Any] | None = None
    payload: bytes = b""
    attachment: bytes | None = None
    encoding: str = ""
    port: str = ""


@dataclass
class _Place:
    """A place in the queue. What stands there may be replaced until it is taken."""

    letter: Letter


class Mailbox:
    """A queue in order of arrival in which a new frame takes the place of the last that still waits, and no EVENT is lost.

    `queue.SimpleQueue` and a lock as a bell hand over in C, which is quicker and steadier than a condition variable in
    Python. The queue's own timeout is not used: in CPython 3.11 `SimpleQueue.get(timeout=...)` waits for ever when its
    deadline passes between two looks at the queue, which short timeouts make likely. One thread waits, and whoever takes,
    takes turns: see `LiveRunner`.
    """

    def __init__(self, on_drop: Callable[[Topic[Any]], None], frames: int = 1) -> None:
        """Begin empty.

        Args:
            on_drop: Called with the topic of each message that is given up.
            frames: How many frames of a topic may wait before a new one takes the place of the last.
        """
        self._frames = frames
        self._places: queue.SimpleQueue[_Place] = queue.SimpleQueue()
        self._bell = threading.Lock()
        self._bell.acquire()
        self._waiting_frames: dict[str, deque[_Place]] = {}
        self._lock = threading.Lock()
        self._on_drop = on_drop

    def put(self, letter: Letter) -> None:
        """Take a letter in; called by receiving threads, never blocks on the node."""
        topic = letter.topic
        if topic is not None and topic.delivery is Delivery.STREAM:
            self._put_frame(topic, letter)
        elif self._places.qsize() < CAPACITY or (topic is not None and topic.delivery is Delivery.EVENT):
            self._places.put(_Place(letter))
            self.ring()
        elif topic is not None:
            self._on_drop(topic)

    def is_empty(self) -> bool:
        """Whether nothing waits."""
        return self._places.empty()

    def wait(self, timeout_s: float) -> None:
        """Return once a letter waits, or the bell is rung, or this time is over."""
        # An old ring is taken back before the look at the queue, so that none for a newer letter is lost.
        self._bell.acquire(blocking=False)
        if self._places.empty():
            self._bell.acquire(timeout=max(0.0, timeout_s))

    def take(self) -> Letter | None:
        """The oldest letter; None if none waits."""
        try:
            place = self._places.get_nowait()
        except queue.Empty:
            return None
        if place.letter.topic is not None and place.letter.topic.delivery is Delivery.STREAM:
            with self._lock:
                self._waiting_frames[place.letter.topic.name].popleft()
        return place.letter

    def ring(self) -> None:
        """End a wait, whether or not a letter has come."""
        with contextlib.suppress(RuntimeError):  # it rings already
            self._bell.release()

    def _put_frame(self, topic: Topic[Any], letter: Letter) -> None:
        with self._lock:
            waiting = self._waiting_frames.setdefault(topic.name, deque())
            if len(waiting) < self._frames:
                place = _Place(letter)
                waiting.append(place)
                self._places.put(place)
                self.ring()
                return
            waiting[-1].letter = letter
        self._on_drop(topic)
