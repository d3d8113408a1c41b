"""Nonsense on every topic during a whole flight changes nothing but the health counters."""

import contextlib
import json
import random
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import zenoh
from flight_process import IN_THE_AIR, flight

from alight.runtime.bus import configuration
from schemas import topics
from schemas.settings.bus import BusSettings
from schemas.topics import Topic
from schemas.wire import MAX_JSON_BYTES, RefusedError, decode, encoding_of
from station.flight_record import read_flight
from station.metrics.summary import summarise

pytestmark = pytest.mark.system


def nonsense(topic: Topic, newest: dict[str, tuple[bytes, bytes | None]]) -> Iterator[tuple[bytes, bytes | None, str]]:
    """Payload, attachment and encoding: malformed, oversized, of another version, full of NaN, out of order."""
    encoding = encoding_of(topic)
    noise = random.Random(topic.name)

    def wrapped(text: bytes) -> tuple[bytes, bytes | None]:
        return (bytes(64), text) if topic.has_pixels else (text, None)

    yield *wrapped(noise.randbytes(100)), encoding
    yield *wrapped(b"[" * (MAX_JSON_BYTES + 10)), encoding
    yield *wrapped(b"{}"), encoding
    yield *wrapped(b"{}"), encoding.rsplit(".v", 1)[0] + ".v999"
    yield *wrapped(b"{}"), "text/plain"
    if topic.name in newest:
        payload, attachment = newest[topic.name]
        text = attachment if attachment is not None else payload
        table = json.loads(text)
        spoilt = {key: float("nan") if isinstance(value, float) else value for key, value in table.items()}
        yield *wrapped(json.dumps(spoilt).encode()), encoding
        stamp = "captured_at_ns" if "captured_at_ns" in table else "at_ns"
        for shift_ns in (-20_000_000_000, 3_600_000_000_000):
            moved = json.dumps(table | {stamp: table[stamp] + shift_ns}).encode()
            yield (payload, moved, encoding) if attachment is not None else (moved, None, encoding)


def harass(endpoint: str, stop: threading.Event, sent: list[int]) -> None:
    with zenoh.open(configuration(BusSettings(connect=(endpoint,)))) as session:
        newest: dict[str, tuple[bytes, bytes | None]] = {}

        def keep(topic: Topic, sample: zenoh.Sample) -> None:
            payload = sample.payload.to_bytes()
            attachment = None if sample.attachment is None else sample.attachment.to_bytes()
            with contextlib.suppress(RefusedError):  # our own nonsense comes back to us, too
                decode(topic, payload, attachment, str(sample.encoding))
                newest.setdefault(topic.name, (payload, attachment))

        held = [
            session.declare_subscriber(topic.key("v1"), lambda sample, topic=topic: keep(topic, sample))
            for topic in topics.TOPICS
        ]
        while not stop.is_set():
            for topic in topics.TOPICS:
                for payload, attachment, encoding in nonsense(topic, newest):
                    key = topic.key("v1", "filter")
                    session.put(key, payload, attachment=attachment, encoding=zenoh.Encoding(encoding))
                    sent[0] += 1
            time.sleep(0.2)
        for subscriber in held:
            subscriber.undeclare()


def test_a_flight_among_nonsense_lands_and_counts_it(tmp_path: Path) -> None:
    stop, sent = threading.Event(), [0]
    with flight(tmp_path / "flight", IN_THE_AIR) as running:
        endpoint = f"tcp/127.0.0.1:{running.bus_port}"
        harasser = threading.Thread(target=harass, args=(endpoint, stop, sent), daemon=True)
        running.wait_for_line(lambda line: "->" in line)
        harasser.start()
        status = running.wait()
        stop.set()
        harasser.join(10.0)
    assert status == 0, running.output
    assert sent[0] > 1000
    record = read_flight(tmp_path / "flight" / "flight.mcap")
    assert summarise(record).verdict.ok
    refused: dict[str, set[str]] = {}
    for health in record.messages(topics.HEALTH):
        assert health.counters["handler_errors"] == 0, f"{health.service} stumbled"
        for entry in health.inputs:
            refused.setdefault(f"{health.service} {entry.topic}", set()).update(entry.refused)
    for reader in ("detector camera/frame", "filter geolocator/fix", "commander filter/estimate"):
        assert {"malformed", "oversized", "wrong_version", "wrong_type", "too_old", "from_the_future"} <= refused[
            reader
        ]
    commander = refused["commander commander/request"]
    assert {"malformed", "wrong_version", "too_old"} <= commander
