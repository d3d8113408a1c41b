"""Puts what is due on the bus, and counts."""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from alight.runtime.clock import seconds
from alight.runtime.node import Pixels
from schemas.frame import FrameHeader
from schemas.message import Message
from schemas.topics import Topic
from schemas.wire import WireMessage, encode
from station.republish.pace import Due, PatientClock
from station.republish.time_map import restamped

Publish = Callable[[Topic[Any], str, WireMessage], None]
PictureOf = Callable[[int], Pixels | None]


@dataclass
class Played:
    """What became of a replay."""

    sent: Counter[str] = field(default_factory=Counter)
    """Messages by topic."""
    given_up: dict[str, str] = field(default_factory=dict)
    """Topics that could not be published to the end, and why: a service appeared."""
    damaged_pictures: int = 0
    """Frames whose picture could not be read."""
    latest_s: float = 0.0
    """By how much a message was late at most, seconds: this machine was too slow."""


class Player:
    """Publishes a recording's messages when they are due."""

    def __init__(
        self, publish: Publish, picture_of: PictureOf, clock: PatientClock, *, original_time: bool, paced: bool = True
    ) -> None:
        """Take what it works with.

        Args:
            publish: Puts a message on the bus; takes topic, service and the message as it travels.
            picture_of: The picture of a frame by its capture time.
            clock: For what is late.
            original_time: Leave the stamps as they were recorded.
            paced: Each message has a time of its own at which it is due; what comes after it is late.
        """
        self._publish = publish
        self._picture_of = picture_of
        self._clock = clock
        self._original_time = original_time
        self._paced = paced
        self.played = Played()

    def play(self, due: Iterable[Due], conflict: Callable[[Topic[Any]], str | None]) -> Played:
        """Publish everything; a topic that may not be published any more is given up for good.

        Args:
            due: The messages, each when it is due, with its map of times.
            conflict: Why a topic may not be published at present; None if it may.
        """
        for times, item in due:
            reason = conflict(item.topic)
            if reason is not None:
                self.played.given_up.setdefault(item.topic.name, reason)
            if item.topic.name in self.played.given_up:
                continue
            if self._paced:
                late_s = seconds(self._clock.now_ns() - times.moved_ns(item.at_ns))
                self.played.latest_s = max(self.played.latest_s, late_s)
            self._send(
                item.topic, item.message, item.message if self._original_time else restamped(item.message, times)
            )
        return self.played

    def _send(self, topic: Topic[Any], recorded: Message, message: Message) -> None:
        pixels: bytes | None = None
        if topic.has_pixels:
            pixels = self._pixels(recorded)
            if pixels is None:
                self.played.damaged_pictures += 1
                return
        service = str(getattr(message, "service", "")) if topic.per_service else ""
        self._publish(topic, service, encode(topic, message, pixels))
        self.played.sent[topic.name] += 1

    def _pixels(self, header: Message) -> bytes | None:
        picture = self._picture_of(header.stamp_ns)
        fits = isinstance(header, FrameHeader) and picture is not None and picture.nbytes == header.payload_bytes
        return picture.tobytes() if picture is not None and fits else None
