"""Where what arrives waits for the node: filled by receiving threads, emptied by the one that runs the node."""

import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from schemas.topics import Delivery, Topic

CAPACITY = 2000
"""Bound of what may wait. A node that falls this far behind loses newly arriving STATE, and says so, and newly
arriving bytes, as on any radio link."""


@dataclass
class Letter:
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
    """A queue in order of arrival in which a new frame takes the place of one that still waits, and no EVENT is lost.

    `queue.SimpleQueue` hands over in C, which is quicker and steadier than a condition variable in Python.
    """

    def __init__(self, on_drop: Callable[[Topic[Any]], None]) -> None:
        self._places: queue.SimpleQueue[_Place] = queue.SimpleQueue()
        self._waiting_frames: dict[str, _Place] = {}
        self._lock = threading.Lock()
        self._on_drop = on_drop

    def put(self, letter: Letter) -> None:
        """Take a letter in; called by receiving threads, never blocks on the node."""
        topic = letter.topic
        if topic is not None and topic.delivery is Delivery.STREAM:
            self._put_frame(topic, letter)
        elif self._places.qsize() < CAPACITY or (topic is not None and topic.delivery is Delivery.EVENT):
            self._places.put(_Place(letter))
        elif topic is not None:
            self._on_drop(topic)

    def take(self, timeout_s: float) -> Letter | None:
        """The oldest letter, waiting for one at most this long; None if none came."""
        try:
            place = self._places.get(timeout=max(0.0, timeout_s))
        except queue.Empty:
            return None
        if place.letter.topic is not None and place.letter.topic.delivery is Delivery.STREAM:
            with self._lock:
                del self._waiting_frames[place.letter.topic.name]
        return place.letter

    def _put_frame(self, topic: Topic[Any], letter: Letter) -> None:
        with self._lock:
            waiting = self._waiting_frames.get(topic.name)
            if waiting is None:
                place = self._waiting_frames[topic.name] = _Place(letter)
                self._places.put(place)
                return
            waiting.letter = letter
        self._on_drop(topic)
