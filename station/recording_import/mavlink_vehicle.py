"""What the commander would have said of the vehicle, had it listened to a recorded MAVLink link."""

from collections.abc import Iterable, Iterator

from alight.runtime.clock import NS_PER_S
from alight.runtime.node import Outputs, Publication
from schemas import topics
from schemas.settings import Settings
from services.commander.node import VEHICLE, CommanderNode
from station.recording_import.heard import Heard
from station.recording_import.tlog import Packet

VEHICLE_TOPICS = (topics.VEHICLE_STATE, topics.VEHICLE_STATUS, topics.GIMBAL_STATE)
LONGEST_SILENCE_NS = 60 * NS_PER_S
"""A gap in a log is passed over beyond this: two flights in one log are hours apart."""


def mavlink_vehicle(packets: Iterable[Packet], settings: Settings) -> Iterator[Heard]:
    """States, status and gimbal of the vehicle, in order of arrival.

    The commander's own code hears every packet at the time at which the log says it came, so that poses are assembled, stamped
    and complained of as in flight. What it would send goes nowhere.
    """
    node = CommanderNode(settings)
    period_ns = node.tick_period_ns
    assert period_ns is not None, "the commander looks around by itself"
    next_tick_ns: int | None = None
    for packet in packets:
        now_ns = packet.received_at_ns
        if next_tick_ns is None or now_ns - next_tick_ns > LONGEST_SILENCE_NS:
            next_tick_ns = now_ns
        while next_tick_ns <= now_ns:
            yield from _said(node.on_tick(next_tick_ns), next_tick_ns)
            next_tick_ns += period_ns
        yield from _said(node.on_bytes(VEHICLE, packet.data, now_ns), now_ns)


def _said(outputs: Outputs, now_ns: int) -> Iterator[Heard]:
    for output in outputs:
        if isinstance(output, Publication) and output.topic in VEHICLE_TOPICS:
            yield Heard(now_ns, output.topic, output.message)
