"""One MAVLink link: bytes in and out, which messages it streams, who was heard on it."""

import math
from collections.abc import Callable

from services.simulator.mavlink.dialect import Message, dialect

AUTOPILOT_COMPONENT = 1

DEFAULT_HZ: dict[int, float] = {
    dialect.MAVLINK_MSG_ID_ATTITUDE: 100.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 50.0,
    dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 50.0,
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 30.0,
    dialect.MAVLINK_MSG_ID_ALTITUDE: 10.0,
    dialect.MAVLINK_MSG_ID_DISTANCE_SENSOR: 10.0,
    dialect.MAVLINK_MSG_ID_VFR_HUD: 10.0,
    dialect.MAVLINK_MSG_ID_TIMESYNC: 10.0,
    dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: 10.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET: 10.0,
    dialect.MAVLINK_MSG_ID_GPS_RAW_INT: 8.0,
    dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5.0,
    dialect.MAVLINK_MSG_ID_SYS_STATUS: 5.0,
    dialect.MAVLINK_MSG_ID_HEARTBEAT: 1.0,
    dialect.MAVLINK_MSG_ID_SYSTEM_TIME: 1.0,
    dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS: 1.0,
    dialect.MAVLINK_MSG_ID_PING: 1.0,
    dialect.MAVLINK_MSG_ID_HOME_POSITION: 0.5,
    dialect.MAVLINK_MSG_ID_BATTERY_STATUS: 0.5,
    dialect.MAVLINK_MSG_ID_CURRENT_MODE: 0.5,
}
"""What PX4 streams on the onboard link, as far as it is provided here."""

FIRST_HEARTBEAT_S = 2.0
TEXT_PERIOD_S = 0.05
TEXT_CHUNK = 50


class Stream:
    """One message that is sent again and again."""

    __slots__ = ("due_s", "message_id", "period_s")

    def __init__(self, message_id: int, period_s: float, due_s: float) -> None:
        self.message_id, self.period_s, self.due_s = message_id, period_s, due_s


class Link:
    """State of one link. Times are seconds since boot."""

    def __init__(self, port: str, system_id: int) -> None:
        self.port = port
        self.gcs_seen = False
        """STATUSTEXT goes only where a ground control station was heard."""
        self.refused = 0
        """Bytes that were no MAVLink."""
        self.sent_home_version = -1
        self._parser = dialect.MAVLink(None)
        self._parser.robust_parsing = True
        self._encoder = dialect.MAVLink(None, srcSystem=system_id, srcComponent=AUTOPILOT_COMPONENT)
        self._streams: dict[int, Stream] = {}
        for order, message_id in enumerate(DEFAULT_HZ):
            # Spread over the first tenth of a second, so that they do not fall on one step.
            self._streams[message_id] = Stream(message_id, 1.0 / DEFAULT_HZ[message_id], 0.1 + 0.004 * order)
        self._streams[dialect.MAVLINK_MSG_ID_HEARTBEAT].due_s = FIRST_HEARTBEAT_S
        self._texts: list[tuple[int, str]] = []
        self._text_due_s = FIRST_HEARTBEAT_S + 1.0
        self._text_id = 0

    def receive(self, data: bytes) -> list[Message]:
        """The messages that the bytes complete."""
        messages = self._parser.parse_buffer(data) or []
        good = [message for message in messages if message.get_msgId() >= 0]
        self.refused += len(messages) - len(good)
        return good

    def encode(self, message: Message) -> bytes:
        """A message as it goes onto the wire."""
        data: bytes = message.pack(self._encoder)
        self._encoder.seq = (self._encoder.seq + 1) % 256
        return data

    def interval_us(self, message_id: int) -> int:
        """Period of a stream; -1 if it is off, 0 if there is no such stream."""
        stream = self._streams.get(message_id)
        if stream is None:
            return 0
        return -1 if math.isinf(stream.period_s) else round(stream.period_s * 1e6)

    def set_interval(self, message_id: int, interval_us: float, now_s: float) -> bool:
        """Change a stream as MAV_CMD_SET_MESSAGE_INTERVAL does: -1 off, 0 default; False if that cannot be."""
        if (
            message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT
            or message_id not in self._streams
            or not math.isfinite(interval_us)
        ):
            return False
        if interval_us < 0.0:
            self._streams[message_id].period_s = math.inf
            self._streams[message_id].due_s = math.inf
            return True
        period_s = interval_us * 1e-6 if interval_us > 0.0 else 1.0 / DEFAULT_HZ[message_id]
        self._streams[message_id] = Stream(message_id, max(period_s, 0.004), now_s)
        return True

    def due(self, now_s: float, build: Callable[[int, "Link"], Message | None]) -> bytes:
        """What the streams send at this moment, all in one piece."""
        out = b""
        for stream in self._streams.values():
            if stream.due_s <= now_s:
                stream.due_s += stream.period_s
                if stream.due_s <= now_s:
                    stream.due_s = now_s + stream.period_s
                message = build(stream.message_id, self)
                if message is not None:
                    out += self.encode(message)
        if self._texts and now_s >= self._text_due_s:
            self._text_due_s = now_s + TEXT_PERIOD_S
            severity, text = self._texts.pop(0)
            out += self._encode_text(severity, text)
        return out

    def say(self, severity: int, text: str) -> None:
        """Queue a STATUSTEXT; it is lost where no ground control station listens."""
        if self.gcs_seen:
            self._texts.append((severity, text))

    def _encode_text(self, severity: int, text: str) -> bytes:
        """One text in as many chunks as it needs; they share an id."""
        data = text.encode("ascii", "replace")
        chunks = [data[start : start + TEXT_CHUNK] for start in range(0, len(data), TEXT_CHUNK)]
        if len(data) % TEXT_CHUNK == 0:
            chunks.append(b"")
        out = b"".join(
            self.encode(dialect.MAVLink_statustext_message(severity, chunk, self._text_id, sequence))
            for sequence, chunk in enumerate(chunks)
        )
        self._text_id = (self._text_id + 1) % 65536
        return out
