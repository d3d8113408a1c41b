"""Links that carry the attitude as angles only, as PX4's and ArduPilot's to a ground station do: quaternions are added to them."""

from collections.abc import Iterator, Sequence
from typing import Any

from alight.geometry.rotation import quaternion_from_euler
from services.commander.dialect import mavlink
from station.recording_import.tlog import Packet

AUTOPILOT_COMPONENT = mavlink.MAV_COMP_ID_AUTOPILOT1


def with_quaternions(packets: Sequence[Packet]) -> Iterator[Packet]:
    """The packets, and behind each ATTITUDE the ATTITUDE_QUATERNION that says the same, if the log has none of an autopilot.

    A packet that cannot be decoded is passed on as it is: whoever listens counts it.
    """
    if any(_is(packet, mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION) for packet in packets):
        yield from packets
        return
    decoder = mavlink.MAVLink(None)
    decoder.robust_parsing = True
    for packet in packets:
        yield packet
        if _is(packet, mavlink.MAVLINK_MSG_ID_ATTITUDE):
            for message in decoder.parse_buffer(bytearray(packet.data)) or ():
                if message.get_msgId() == mavlink.MAVLINK_MSG_ID_ATTITUDE:
                    yield Packet(packet.received_at_ns, _quaternion(message))


def _is(packet: Packet, message_id: int) -> bool:
    return packet.message_id == message_id and packet.component == AUTOPILOT_COMPONENT


def _quaternion(attitude: Any) -> bytes:
    q = quaternion_from_euler(attitude.roll, attitude.pitch, attitude.yaw)
    rates = (attitude.rollspeed, attitude.pitchspeed, attitude.yawspeed)
    message = mavlink.MAVLink_attitude_quaternion_message(attitude.time_boot_ms, *q, *rates)
    encoder = mavlink.MAVLink(None, attitude.get_srcSystem(), attitude.get_srcComponent())
    return bytes(message.pack(encoder))
