"""Asks geolocator and filter again: what they make of a recorded flight under other settings."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from alight.runtime.node import Arrival, Node, Publication
from schemas import topics
from schemas.estimate import PadEstimate
from schemas.fix import PadFix
from schemas.fusion import Fusion, FusionVerdict
from schemas.message import Message
from schemas.settings import Settings
from schemas.topics import Topic
from services.filter.service import build as build_filter
from services.geolocator.service import build as build_geolocator
from station.flight_record import FlightRecord, Logged

LATENCY_ORDER_NS = 1
"""A fix that is located anew comes this much after its detection, as far as the order of the inputs goes."""


@dataclass(frozen=True)
class Filtering:
    """What one filter made of a flight."""

    estimates: tuple[Logged[PadEstimate], ...]
    """With the time at which each was released, UTC ns: that of its fix."""
    verdicts: dict[int, FusionVerdict]
    """Of each fix, by capture time, UTC ns."""


def recorded_fixes(record: FlightRecord) -> tuple[Logged[PadFix], ...]:
    """The fixes as they were in flight."""
    return record.logged(topics.PAD_FIX)


def relocated_fixes(
    record: FlightRecord,
    settings: Settings,
    pose: Literal["capture", "latest"],
    method: Literal["pnp", "bearing", "fused"] | None = None,
) -> tuple[Logged[PadFix], ...]:
    """The fixes that today's geolocator makes of the recorded detections.

    Args:
        record: The flight.
        settings: Its settings.
        pose: Which pose of the vehicle to take, whatever the settings say.
        method: Which way to a fix; None for that of the settings.
    """
    lookup = settings.geolocator.lookup.model_copy(update={"pose": pose})
    changes = {"lookup": lookup} if method is None else {"lookup": lookup, "method": method}
    geolocator = settings.geolocator.model_copy(update=changes)
    node = build_geolocator(settings.model_copy(update={"geolocator": geolocator}))
    fixes: list[Logged[PadFix]] = []
    for topic, logged in _in_order([(topic, record.logged(topic)) for topic in node.subscriptions]):
        after_ns = logged.logged_at_ns + LATENCY_ORDER_NS
        fixes += [
            Logged(one.message, after_ns) for one in _given(node, topic, logged) if isinstance(one.message, PadFix)
        ]
    return tuple(fixes)


def filtered(record: FlightRecord, fixes: Sequence[Logged[PadFix]], settings: Settings) -> Filtering:
    """What the filter of these settings makes of the fixes; nothing of it steers."""
    node = build_filter(settings)
    estimates: list[Logged[PadEstimate]] = []
    verdicts: dict[int, FusionVerdict] = {}
    inputs = [(topics.VEHICLE_STATE, record.logged(topics.VEHICLE_STATE)), (topics.PAD_FIX, fixes)]
    for topic, logged in _in_order(inputs):
        outputs = _given(node, topic, logged)
        if topic is topics.PAD_FIX:
            outputs += [output for output in node.on_tick(logged.logged_at_ns) if isinstance(output, Publication)]
        for output in outputs:
            if isinstance(output.message, PadEstimate):
                estimates.append(Logged(output.message, logged.logged_at_ns))
            elif isinstance(output.message, Fusion) and output.message.captured_at_ns is not None:
                verdicts[output.message.captured_at_ns] = output.message.attempts[0].verdict
    return Filtering(tuple(estimates), verdicts)


def _given(node: Node, topic: Topic[Any], logged: Logged[Message]) -> list[Publication]:
    arrival = Arrival(topic, logged.message, logged.logged_at_ns, logged.logged_at_ns)
    return [output for output in node.on_message(arrival) if isinstance(output, Publication)]


def _in_order(
    inputs: Sequence[tuple[Topic[Any], Sequence[Logged[Any]]]],
) -> Iterator[tuple[Topic[Any], Logged[Any]]]:
    heard = [(topic, logged) for topic, messages in inputs for logged in messages]
    yield from sorted(heard, key=lambda one: one[1].logged_at_ns)
