"""The messages that the commander lives on, and asking for them again when they stop."""

from dataclasses import dataclass

from alight.runtime.clock import nanoseconds
from schemas.settings.commander import LinkSettings
from services.commander.command_queue import Command
from services.commander.dialect import mavlink

PATIENCE_PERIODS = 5.0
PATIENCE_AT_LEAST_S = 2.0
"""A stream that is silent for five periods, or two seconds if that is longer, is asked for again."""
ASK_AGAIN_S = 2.0


@dataclass(frozen=True)
class Stream:
    """One message and how often it shall come."""

    message_id: int
    rate_hz: float


def wanted_streams(settings: LinkSettings) -> tuple[Stream, ...]:
    """All of them. HEARTBEAT is not among them: PX4 sends it at 1 Hz and refuses any other rate."""
    return (
        Stream(mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, settings.position_hz),
        Stream(mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, settings.attitude_hz),
        Stream(mavlink.MAVLINK_MSG_ID_CURRENT_MODE, 10.0),
        Stream(mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 5.0),
        Stream(mavlink.MAVLINK_MSG_ID_SYS_STATUS, 5.0),
        Stream(mavlink.MAVLINK_MSG_ID_GPS_RAW_INT, 2.0),
        Stream(mavlink.MAVLINK_MSG_ID_HOME_POSITION, 0.5),
        Stream(mavlink.MAVLINK_MSG_ID_BATTERY_STATUS, 0.5),
    )


class StreamRequests:
    """Knows which stream came when, and which has to be asked for."""

    def __init__(self, settings: LinkSettings) -> None:
        self._streams = {stream.message_id: stream for stream in wanted_streams(settings)}
        self.requests = 0
        """Requests made since start."""
        self.reset()

    def reset(self) -> None:
        """Ask for everything anew: the autopilot is new or has booted."""
        self._asked_ns: dict[int, int] = {}
        self._heard_ns: dict[int, int] = {}

    def heard(self, message_id: int, now_ns: int) -> None:
        """Note that a message came."""
        if message_id in self._streams:
            self._heard_ns[message_id] = now_ns

    def due(self, now_ns: int) -> list[Command]:
        """The requests to send now."""
        return [self._request(stream, now_ns) for stream in self._streams.values() if self._silent(stream, now_ns)]

    def _silent(self, stream: Stream, now_ns: int) -> bool:
        asked_ns = self._asked_ns.get(stream.message_id)
        if asked_ns is None:
            return True
        patience_s = max(PATIENCE_PERIODS / stream.rate_hz, PATIENCE_AT_LEAST_S)
        since_ns = max(asked_ns + nanoseconds(ASK_AGAIN_S), self._heard_ns.get(stream.message_id, 0))
        return now_ns - since_ns > nanoseconds(patience_s)

    def _request(self, stream: Stream, now_ns: int) -> Command:
        self._asked_ns[stream.message_id] = now_ns
        self.requests += 1
        return Command(
            f"request message {stream.message_id}",
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
            (float(stream.message_id), round(1e6 / stream.rate_hz)),
            flight=False,
        )
