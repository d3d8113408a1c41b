"""STATUSTEXT: texts in, joined from their chunks; texts out, cut to the field."""

from typing import Any

from services.commander.dialect import mavlink

FIELD_CHARS = 50


class TextJoiner:
    """Joins the chunks of long texts. A new id, a gap or a short chunk ends a text."""

    def __init__(self) -> None:
        self._id = 0
        self._chunks: list[str] = []

    def take(self, message: Any) -> str | None:
        """Take one STATUSTEXT; returns what can be shown of the text so far, None if nothing.

        Each chunk of a long text returns the text up to it: a lost last chunk costs its words, not the text.
        """
        if message.id == 0 or message.chunk_seq == 0 or message.id != self._id:
            self._chunks = []
        if message.chunk_seq != len(self._chunks):
            return None
        self._id = message.id
        self._chunks.append(message.text)
        return "".join(self._chunks).strip()[:500] or None


def status_text(text: str, severity: int) -> Any:
    """The STATUSTEXT message of one short text of ours."""
    return mavlink.MAVLink_statustext_message(severity, text.encode("ascii", "replace")[:FIELD_CHARS])
