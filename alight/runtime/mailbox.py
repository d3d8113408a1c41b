"""Where what arrives waits for the node: filled by receiving threads, emptied by the one that runs the node."""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from schemas.topics import Delivery, Topic

CAPACITY = 2000
"""Bound of the queue. A node that falls this far behind loses the oldest STATE, and says so."""


@dataclass
class Letter:
    """A message as it came over the bus, or bytes as they came through a port."""

    received_at_ns: int
    topic: Topic[Any] | None = None
    payload: bytes = b""
    attachment: bytes | None = None
    encoding: str = ""
    port: str = ""


class Mailbox:
    """A queue in order of arrival in which the newest frame replaces one that still waits, and EVENTs are never lost."""

    def __init__(self, on_drop: Callable[[Topic[Any]], None]) -> None:
        self._letters: deque[Letter] = deque()
        self._waiting_stream: dict[str, Letter] = {}
        self._filled = threading.Condition()
        self._on_drop = on_drop

    def put(self, letter: Letter) -> None:
        """Take a letter in; called by receiving threads, never blocks on the node."""
        with self._filled:
            if letter.topic is not None and letter.topic.delivery is Delivery.STREAM:
                self._replace_stream(letter.topic, letter)
            self._letters.append(letter)
            self._shed()
            self._filled.notify()

    def take(self, timeout_s: float) -> Letter | None:
        """The oldest letter, waiting for one at most this long; None if none came."""
        with self._filled:
            if not self._letters:
                self._filled.wait(max(0.0, timeout_s))
            if not self._letters:
                return None
            letter = self._letters.popleft()
            if letter.topic is not None:
                self._waiting_stream.pop(letter.topic.name, None)
            return letter

    def _replace_stream(self, topic: Topic[Any], letter: Letter) -> None:
        waiting = self._waiting_stream.get(topic.name)
        if waiting is not None:
            self._letters.remove(waiting)
            self._on_drop(topic)
        self._waiting_stream[topic.name] = letter

    def _shed(self) -> None:
        while len(self._letters) > CAPACITY:
            for index, letter in enumerate(self._letters):
                if letter.topic is None or letter.topic.delivery is not Delivery.EVENT:
                    del self._letters[index]
                    if letter.topic is not None:
                        self._on_drop(letter.topic)
                    break
            else:
                return
