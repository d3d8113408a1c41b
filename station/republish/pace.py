"""When each message is due: by a clock that is passed in, at a speed, or a frame at each step."""

import time
from collections.abc import Callable, Iterable, Iterator
from typing import Protocol

from alight.runtime.clock import WallClock, seconds
from station.republish.excerpt import Excerpt, Item
from station.republish.time_map import TimeMap

LONGEST_SLEEP_S = 0.2
"""A clock that is set forward must not leave the replay asleep."""


class PatientClock(Protocol):
    """Tells the time and can wait."""

    def now_ns(self) -> int:
        """The time, UTC ns."""
        ...

    def wait_until(self, at_ns: int) -> None:
        """Return at this time, UTC ns; at once if it is past."""
        ...


class PatientWallClock(WallClock):
    """The host's clock, with sleep."""

    def wait_until(self, at_ns: int) -> None:
        """See `PatientClock.wait_until`."""
        while (left_s := seconds(at_ns - self.now_ns())) > 0.0:
            time.sleep(min(left_s, LONGEST_SLEEP_S))


Due = tuple[TimeMap, Item]


def steadily(excerpt: Excerpt, clock: PatientClock, speed: float) -> Iterator[Due]:
    """Each message when it is due, all by one map of times: recorded seconds pass `speed` times as fast as the clock's."""
    times = TimeMap(excerpt.began_ns, clock.now_ns(), speed)
    for item in excerpt.items:
        clock.wait_until(times.moved_ns(item.at_ns))
        yield times, item


def stepwise(excerpt: Excerpt, clock: PatientClock, go_on: Callable[[Item], bool]) -> Iterator[Due]:
    """All messages up to and with the next frame, whenever `go_on`, given the last message of the step, says so; what follows the last frame makes the last step.

    The messages of a step share one offset, by which the frame came just now. So within a step frames and vehicle states fit
    together however long the pause before it was, and nothing speaks of the future.
    """
    before: TimeMap | None = None
    for step in _steps(excerpt.items):
        if not go_on(step[-1]):
            return
        ends_ns = step[-1].at_ns
        if before is not None:
            # Steps quicker than the flight itself would turn the order of the stamps round.
            clock.wait_until(before.moved_ns(ends_ns))
        before = TimeMap(ends_ns, clock.now_ns())
        for item in step:
            yield before, item


def _steps(items: Iterable[Item]) -> Iterator[list[Item]]:
    step: list[Item] = []
    for item in items:
        step.append(item)
        if item.topic.has_pixels:
            yield step
            step = []
    if step:
        yield step
