"""The Zenoh session of one process: publishers and subscribers with the delivery class that the table gives."""

import json
import logging
import os
import re
from collections.abc import Callable
from typing import Any

import zenoh
import zenoh.ext

from schemas.settings.bus import BusSettings
from schemas.topics import Delivery, Topic
from schemas.wire import WireMessage, encoding_of

LOGGER = logging.getLogger("alight")

LEASE_MS = 2000
"""A peer that is silent for longer counts as gone (Zenoh's default, 10 s, is long in the air)."""

STALLED_US = 100_000
"""A reader that takes nothing for so long while its queue is full is let go, and may come back. Zenoh's default, 5 s, is how long
one reader that stands still (a recorder on a busy host, a ground station behind a broken link) would hold the commander up."""

THREADS = "(rx: (worker_threads: 1), tx: (worker_threads: 1))"
"""Zenoh's threads that receive and send, in its own notation. With the one of each that our rates need, no message wakes a second
thread on its way: a hop is about 8 % shorter."""

_SOURCE_PLACE = re.compile(r" at /\S+?\.rs:\d+\.?")
_TAKEN = "Address already in use"

OnSample = Callable[[Topic[Any], bytes, bytes | None, str], None]


class BusError(Exception):
    """The bus cannot be joined: which endpoint, why, and what to do."""


class Bus:
    """One process on the bus of one vehicle."""

    def __init__(self, vehicle: str, settings: BusSettings) -> None:
        """Join the bus.

        Raises:
            BusError: If an endpoint to listen on cannot be had, or a client finds no router.
        """
        zenoh.init_log_from_env_or("error")
        os.environ.setdefault("ZENOH_RUNTIME", THREADS)  # read once, when the process's first session opens
        self._vehicle = vehicle
        try:
            self._session = zenoh.open(configuration(settings))
        except zenoh.ZError as error:
            raise BusError(
                f"cannot join the bus (bus.listen = {list(settings.listen)}, bus.connect = {list(settings.connect)}): "
                f"{zenoh_reason(error)}; {_remedy(error)}"
            ) from None
        self._publishers: dict[tuple[Topic[Any], str], Any] = {}
        self._held: list[Any] = []

    @property
    def session(self) -> zenoh.Session:
        """Zenoh's, for what is neither published nor subscribed to."""
        return self._session

    def announce(self, service: str) -> None:
        """Show that a service lives, for as long as this process does (a liveliness token)."""
        self._held.append(self._session.liveliness().declare_token(alive_key(self._vehicle, service)))

    def watch_alive(self, on_change: Callable[[str, bool], None]) -> None:
        """Call back with (service, alive) whenever a service's token appears or vanishes."""

        def on_sample(sample: zenoh.Sample) -> None:
            on_change(str(sample.key_expr).rsplit("/", 1)[-1], sample.kind == zenoh.SampleKind.PUT)

        key = alive_key(self._vehicle, "*")
        self._held.append(self._session.liveliness().declare_subscriber(key, on_sample, history=True))

    def publish(self, topic: Topic[Any], service: str, wire: WireMessage, held: Any = None) -> None:
        """Send one message.

        Args:
            topic: Where.
            service: Whose.
            wire: The message.
            held: Its payload in shared memory, if it is there (see `FrameMemory`).
        """
        payload = wire.payload if held is None else held
        self._publisher(topic, service).put(payload, attachment=wire.attachment)

    def is_heard(self, topic: Topic[Any], service: str) -> bool:
        """Whether anybody listens to what a service publishes on a topic."""
        return bool(self._publisher(topic, service).matching_status.matching)

    def subscribe(self, topic: Topic[Any], on_sample: OnSample) -> None:
        """Hand every sample of a topic to `on_sample`, which must return soon.

        It runs on a thread that Zenoh starts for this subscription. While it is busy some 250 samples may wait; then the thread
        that receives for all subscriptions waits, too.
        """

        def forward(sample: zenoh.Sample) -> None:
            attachment = sample.attachment
            on_sample(
                topic,
                sample.payload.to_bytes(),
                None if attachment is None else attachment.to_bytes(),
                str(sample.encoding),
            )

        key = topic.key(self._vehicle)
        if topic.delivery is Delivery.STATE:
            history = zenoh.ext.HistoryConfig(detect_late_publishers=True)
            self._held.append(zenoh.ext.declare_advanced_subscriber(self._session, key, forward, history=history))
        else:
            self._held.append(self._session.declare_subscriber(key, forward))

    def close(self) -> None:
        """Leave the bus."""
        self._session.close()  # type: ignore[no-untyped-call]

    def _publisher(self, topic: Topic[Any], service: str) -> Any:
        publisher = self._publishers.get((topic, service))
        if publisher is None:
            publisher = self._declare_publisher(topic, topic.key(self._vehicle, service))
            self._publishers[topic, service] = publisher
        return publisher

    def _declare_publisher(self, topic: Topic[Any], key: str) -> Any:
        common: dict[str, Any] = {"encoding": zenoh.Encoding(encoding_of(topic))}
        if topic.delivery is Delivery.STREAM:
            control = zenoh.CongestionControl.DROP
            return self._session.declare_publisher(key, congestion_control=control, **common)
        control = zenoh.CongestionControl.BLOCK
        if topic.delivery is Delivery.EVENT:
            return self._session.declare_publisher(key, congestion_control=control, **common)
        cache = zenoh.ext.CacheConfig(max_samples=1)
        return zenoh.ext.declare_advanced_publisher(
            self._session, key, cache=cache, publisher_detection=True, congestion_control=control, **common
        )


def zenoh_reason(error: zenoh.ZError) -> str:
    """What Zenoh says is wrong, without the lines of its source."""
    return _SOURCE_PLACE.sub("", str(error))


def _remedy(error: zenoh.ZError) -> str:
    if _TAKEN in str(error):
        return "is the port taken by another flight? Set bus.listen and bus.connect to a free one"
    return "check bus.listen and bus.connect"


def alive_key(vehicle: str, service: str) -> str:
    """Key of a service's liveliness token."""
    return f"alight/{vehicle}/alive/{service}"


def configuration(settings: BusSettings) -> zenoh.Config:
    """Zenoh's configuration for these settings."""
    config = zenoh.Config()
    for key, value in configuration_values(settings).items():
        config.insert_json5(key, json.dumps(value))
    return config


def configuration_values(settings: BusSettings) -> dict[str, object]:
    """What Alight sets in Zenoh's configuration, by key; the rest stays as Zenoh has it."""
    return {
        "mode": settings.mode,
        "connect/endpoints": list(settings.connect),
        # A peer goes on trying for ever: whoever it looks for may start later, or come back. A client without a router is of no use.
        "connect/timeout_ms": -1 if settings.mode == "peer" else 10_000,
        "connect/retry": {"period_init_ms": 200, "period_max_ms": 2000, "period_increase_factor": 1.5},
        "connect/exit_on_failure": settings.mode == "client",
        "listen/endpoints": list(settings.listen),
        # Multicast would reach beyond the hosts that the settings name.
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": True,
        "transport/link/tx/lease": LEASE_MS,
        "transport/link/tx/queue/congestion_control/block/wait_before_close": STALLED_US,
        "transport/shared_memory/enabled": settings.shared_memory,
        "timestamping/enabled": True,
    }
