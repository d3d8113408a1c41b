"""Makes entries of messages, and numbers them."""

from typing import Any

from schemas.frame import FrameHeader
from schemas.message import Message
from schemas.settings import Settings
from schemas.topics import Topic
from services.recorder.channels import channel_name, channels, picture_channel_name
from services.recorder.entry import Entry, Picture


class EntryMaker:
    """Counts what is given to the file, channel by channel, so that a gap in the numbers shows a loss on the way to it."""

    def __init__(self, settings: Settings) -> None:
        self._given = {channel.name: 0 for channel in channels(settings)}

    def of_message(self, topic: Topic[Any], message: Message, received_at_ns: int, now_ns: int) -> Entry | None:
        """A message's entry; None if its sender is none that the table of topics knows.

        Fields without a value are left out of the text: absent means None.
        """
        data = message.__pydantic_serializer__.to_json(message, exclude_none=True)
        return self._numbered(channel_name(topic, message), data, received_at_ns, now_ns, message.stamp_ns)

    def of_picture(
        self, topic: Topic[Any], header: FrameHeader, picture: Picture | bytes, received_at_ns: int, now_ns: int
    ) -> Entry | None:
        """The entry of a picture that is still to be made, or of one as it was recorded; None if none are kept."""
        return self._numbered(picture_channel_name(topic), picture, received_at_ns, now_ns, header.captured_at_ns)

    def _numbered(
        self, channel: str, data: bytes | Picture, received_at_ns: int, now_ns: int, stamp_ns: int
    ) -> Entry | None:
        sequence = self._given.get(channel)
        if sequence is None:
            return None
        self._given[channel] += 1
        return Entry(channel, data, sequence, received_at_ns, now_ns, stamp_ns)
