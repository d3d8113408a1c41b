"""The node: what a service decides, free of sockets, clocks and threads.

A node takes typed messages and the time and returns what is to be published or sent. The same node runs live (its own
process on Zenoh), in lockstep (one process, virtual clock) and in replay (fed from a recording).
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from schemas import topics
from schemas.health import ClockHealth
from schemas.message import Message
from schemas.topics import Topic

M = TypeVar("M", bound=Message)
M_co = TypeVar("M_co", bound=Message, covariant=True)
Pixels = NDArray[np.uint8]


class Arrival(NamedTuple, Generic[M_co]):
    """A message that came in."""

    topic: Topic[M_co]
    message: M_co
    received_at_ns: int
    """When it reached the process, UTC ns."""
    now_ns: int
    """When the node takes it up, UTC ns."""
    pixels: Pixels | None = None
    """The picture beside a frame header: (height, width) or (height, width, 3), uint8; read only."""


@dataclass(frozen=True)
class Publication:
    """A message to publish."""

    topic: Topic[Any]
    message: Message
    pixels: Pixels | None = None
    release_at_ns: int | None = None
    """Keep it back until then, UTC ns: for what a simulated sensor knows before its time."""


@dataclass(frozen=True)
class Transmission:
    """Bytes to send through one of the service's ports."""

    port: str
    data: bytes
    release_at_ns: int | None = None
    """Keep them back until then, UTC ns."""


Output = Publication | Transmission
Outputs = Iterable[Output]


class Node:
    """Base of all nodes.

    A subclass names its service, registers a handler for each topic it wants with `subscribe` (the table of topics must
    list it among the readers) and overrides `on_tick` and `on_bytes` as it needs. It must not read a clock, open
    anything, start a thread or draw unseeded random numbers.
    """

    service: ClassVar[str]
    """Name of the service in the table of topics."""
    tick_period_ns: int | None = None
    """How often `on_tick` is called; None for never."""
    frames_waiting: ClassVar[int] = 1
    """How many frames may wait for a busy node, live; a newer one then takes the place of the last. Who steers wants the newest
    only, who records wants them all."""
    takes_any_age: ClassVar[bool] = False
    """Whether messages that are older than their topic allows are let in: they may not steer, but they are recorded."""
    answers_at_once: ClassVar[bool] = False
    """Whether, live, the thread that receives a message may run the handlers itself, one at a time as ever. Not for a node that may
    stand still (a disk, a network): once some 250 messages wait for that thread, all reception of the process waits."""
    ports: tuple[str, ...] = ()
    """Names of the byte ports the node talks through, such as `vehicle`."""

    def __init__(self) -> None:
        self._handlers: dict[str, Callable[[Arrival[Any]], Outputs]] = {}

    def subscribe(self, topic: Topic[M], handler: Callable[[Arrival[M]], Outputs]) -> None:
        """Register the handler of a topic.

        Raises:
            ValueError: If the table of topics does not let this service read the topic.
        """
        if self.service not in topic.readers:
            raise ValueError(
                f"{self.service} may not read {topic.name}: it is not among its readers in schemas/topics.py"
            )
        self._handlers[topic.name] = handler

    @property
    def subscriptions(self) -> tuple[Topic[Any], ...]:
        """The topics this node wants."""
        return tuple(topics.BY_NAME[name] for name in self._handlers)

    def on_message(self, arrival: Arrival[Any]) -> Outputs:
        """Take one message; called in order of arrival, never concurrently."""
        return self._handlers[arrival.topic.name](arrival)

    def on_tick(self, now_ns: int) -> Outputs:  # noqa: ARG002
        """Do what is due at `now_ns`, UTC ns; called every `tick_period_ns`, later if the process was busy."""
        return ()

    def on_bytes(self, port: str, data: bytes, now_ns: int) -> Outputs:  # noqa: ARG002
        """Take bytes that came through a port."""
        return ()

    def counters(self) -> Mapping[str, int]:
        """The service's own counters since start, for `health`."""
        return {}

    def complaints(self, now_ns: int) -> tuple[str, ...]:  # noqa: ARG002
        """What is wrong now beyond stale input, in words, for `health`."""
        return ()

    def clocks(self, now_ns: int) -> tuple[ClockHealth, ...]:  # noqa: ARG002
        """Clocks that the node itself measures (the autopilot's), for `health`."""
        return ()

    def on_stop(self, now_ns: int) -> Outputs:  # noqa: ARG002
        """Say the last words (a vehicle to be left in hold); they are sent before the process ends."""
        return ()

    def close(self) -> None:
        """Let go of what is held (a file to be completed); called once, last."""
