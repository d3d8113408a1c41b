"""The page `docs/topics.md`, made from the table of topics: `python -m station.topics_page docs/topics.md`."""

import sys
from pathlib import Path
from typing import Any

from schemas import topics
from schemas.message import SCHEMA_VERSION
from schemas.topics import Topic
from schemas.wire import encoding_of

_HEAD = f"""# Topics

Made from `schemas/topics.py` by `python -m station.topics_page docs/topics.md`; a test fails when this page is behind.
Every key is `alight/<vehicle>/<topic>`. Messages are pydantic JSON of schema version {SCHEMA_VERSION}; the Zenoh encoding names message and
version, and a message of another version is refused. `alight schema export DIR` writes the JSON Schemas.

Delivery: `stream`: the newest wins and any may be dropped; `state`: reliable, and who joins late gets the newest;
`event`: reliable and never dropped.

"""

_BETWEEN = """
The recorder also reads every topic, and the recorder and the station read the health of every service.

| topic | message | delivery | rate | stale after | refused when older than | published by | read by | Zenoh encoding |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |
"""

_TAIL = """
`camera/frame` carries the raw pixels as payload and the message as attachment beside them. `health` has one key for each
service: `alight/<vehicle>/health/<service>`. The ground truth is for the renderer of simulated pictures, the recorder
and the reports; of the mission's services only the camera may read it.

Beside the topics there are two keys for each service: its liveliness token `alight/<vehicle>/alive/<service>`, and
`alight/<vehicle>/clock/<service>`, where it answers with its time (a `ClockReading` in JSON) whoever asks by a Zenoh query. A service that
does not answer is taken as it is.
"""


def topics_page() -> str:
    """The page in Markdown, with a Mermaid diagram."""
    return _HEAD + _diagram() + _BETWEEN + "".join(_row(topic) for topic in topics.TOPICS) + _TAIL


def _diagram() -> str:
    lines = ["```mermaid", "flowchart LR"]
    lines += [f"  {edge}" for topic in topics.TOPICS if not topic.per_service for edge in _edges(topic)]
    return "\n".join([*lines, "```", ""])


def _edges(topic: Topic[Any]) -> list[str]:
    readers = sorted(topic.readers - {"recorder"})
    arrow = "-.->" if topic.name == topics.GROUND_TRUTH.name else "-->"
    return [f"{sender} {arrow}|{topic.name}| {reader}" for sender in sorted(topic.publishers) for reader in readers]


def _row(topic: Topic[Any]) -> str:
    cells = [
        f"`{topic.name}`",
        f"`{topic.message.__name__}`",
        topic.delivery.value,
        f"{topic.nominal_hz:g} Hz" if topic.nominal_hz else "as it comes",
        "never" if topic.stale_after_s is None else f"{topic.stale_after_s:g} s",
        "never" if topic.max_age_s is None else f"{topic.max_age_s:g} s",
        "every service" if topic.per_service else ", ".join(sorted(topic.publishers)),
        ", ".join(sorted(topic.readers)),
        f"`{encoding_of(topic)}`",
    ]
    return f"| {' | '.join(cells)} |\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(topics_page())
