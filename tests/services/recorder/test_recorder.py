"""The recorder: one MCAP a flight, repeatable, readable after a crash, harmless when the disk fails."""

import json
import resource
from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

import cv2
import jsonschema
import numpy as np
import pytest
from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader

from alight.runtime.clock import LOCKSTEP_EPOCH_NS, NS_PER_S
from alight.runtime.node import Arrival
from schemas import topics
from schemas.detection import Detection, Marker, MarkerPose
from schemas.frame import FrameHeader
from schemas.health import Health, InputHealth
from schemas.message import Part
from schemas.mission import MissionReply
from schemas.settings import Settings
from services.recorder import flight_file
from services.recorder.flight_file import FlightFileError
from services.recorder.picture import FrameChooser
from services.recorder.service import build, open_ports

R = TypeVar("R", bound=McapRecord)
POSE = MarkerPose(
    position_camera_m=(0.1, 0.2, 5.0), q_camera_marker=(0.0, 1.0, 0.0, 0.0), reprojection_error_px=0.1,
    covariance=(0.0,) * 36,
)  # fmt: skip
MARKER = Marker(
    family="5x5_1000", id=68, side_m=1.0, corners_px=((1, 2), (3, 4), (5, 6), (7, 8)), corner_sigma_px=0.2,
    poses=(POSE,), ambiguity=0.5,
)  # fmt: skip


def settings(directory: Path, **recorder: object) -> Settings:
    return Settings.model_validate({"seed": 3, "recorder": {"directory": directory, **recorder}})


def frame(number: int, captured_at_ns: int = LOCKSTEP_EPOCH_NS) -> FrameHeader:
    return FrameHeader(captured_at_ns=captured_at_ns, sequence=number, width_px=64, height_px=48, source="test")


def picture(number: int = 0) -> np.ndarray:
    ramp = np.add.outer(np.arange(48), np.arange(64)) + number
    return (ramp % 200).astype(np.uint8)


def detection(at_ns: int) -> Detection:
    return Detection(captured_at_ns=at_ns, frame_sequence=1, detector="aruco", markers=(MARKER,))


def health(at_ns: int, service: str = "filter") -> Health:
    silent = InputHealth(
        topic="geolocator/fix", received=0, rate_hz=0.0, dropped=0, refused={"malformed": 2}, stale=True
    )
    return Health(
        at_ns=at_ns,
        service=service,
        pid=0,
        uptime_s=1.0,
        inputs=(silent,),
        outputs=(),
        counters={"a": 1},
        complaints=(),
    )


def feed(node, seconds: float = 2.0) -> None:
    """Ten frames, detections and a health report a second, with the ticks in between."""
    for number in range(int(seconds * 10)):
        now_ns = LOCKSTEP_EPOCH_NS + number * NS_PER_S // 10
        node.on_message(Arrival(topics.FRAME, frame(number, now_ns), now_ns, now_ns, picture(number)))
        node.on_message(Arrival(topics.DETECTION, detection(now_ns), now_ns, now_ns + 5))
        if number % 10 == 0:
            node.on_message(Arrival(topics.HEALTH, health(now_ns), now_ns, now_ns))
        if number % 5 == 4:
            node.on_tick(now_ns)


def recorded(path: Path) -> list[tuple[str, Message]]:
    with path.open("rb") as file:
        return [
            (channel.topic, message) for _, channel, message in make_reader(file, validate_crcs=True).iter_messages()
        ]


def whole(path: Path, kind: type[R]) -> list[R]:
    """What a reader that goes front to back gets out of a file without an end."""
    kept: list[R] = []
    with path.open("rb") as file, suppress(EndOfFile):
        kept.extend(record for record in StreamReader(file).records if isinstance(record, kind))
    return kept


def test_every_topic_the_table_allows_is_subscribed(tmp_path):
    node = build(settings(tmp_path))
    assert {topic.name for topic in node.subscriptions} == {topic.name for topic in topics.read_by("recorder")}
    assert open_ports(settings(tmp_path)) == {}
    node.close()


def test_messages_are_kept_with_arrival_and_stamp_under_their_full_key(tmp_path):
    node = build(settings(tmp_path))
    feed(node)
    node.close()
    kept = recorded(tmp_path / "flight.mcap")
    _, message = next(entry for entry in kept if entry[0] == "alight/v1/detector/detection")
    assert (message.log_time, message.publish_time) == (LOCKSTEP_EPOCH_NS + 5, LOCKSTEP_EPOCH_NS)
    assert Detection.model_validate_json(message.data) == detection(LOCKSTEP_EPOCH_NS)
    assert sum(key == "alight/v1/health/filter" for key, _ in kept) == 2
    assert (node.counters()["recorded"], node.counters()["lost"]) == (62, 0)


def test_recorded_messages_are_valid_under_the_schema_beside_them(tmp_path):
    node = build(settings(tmp_path))
    feed(node)
    node.close()
    with (tmp_path / "flight.mcap").open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            assert schema is not None and schema.encoding == "jsonschema" and channel.message_encoding == "json"
            jsonschema.validate(json.loads(message.data), json.loads(schema.data))


def plain(schema: dict, path: str = "") -> Iterator[str]:
    """Places that Foxglove's reader of JSON Schemas cannot follow."""
    kind = schema.get("type")
    if kind == "object":
        for name, field in schema["properties"].items():
            yield from plain(field, f"{path}.{name}")
    elif kind == "array":
        if schema["items"].get("type") == "array":
            yield f"{path}: array of arrays"
        yield from plain(schema["items"], f"{path}[]")
    elif kind not in ("string", "number", "integer", "boolean"):
        yield f"{path}: {schema}"


def test_recorded_schemas_keep_to_the_dialect_of_viewers(tmp_path):
    build(settings(tmp_path)).close()
    feed(node := build(settings(tmp_path / "fed")))
    node.close()
    with (tmp_path / "fed" / "flight.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert len(summary.schemas) == len(topics.TOPICS) + 1
    for schema in summary.schemas.values():
        assert list(plain(json.loads(schema.data), schema.name)) == []


def parts_of(annotation: object) -> set[type[Part]]:
    if isinstance(annotation, type) and issubclass(annotation, Part):
        inner = (field.annotation for field in annotation.model_fields.values())
        return {annotation}.union(*(parts_of(one) for one in inner))
    return set().union(*(parts_of(one) for one in getattr(annotation, "__args__", ())))


def test_an_absent_field_always_means_none():
    """Null fields are left out of the recording, so every field that may be None must default to None."""
    for topic in topics.TOPICS:
        for part in parts_of(topic.message):
            for name, field in part.model_fields.items():
                if type(None) in getattr(field.annotation, "__args__", ()):
                    assert field.default is None, f"{part.__name__}.{name}"


def test_frames_are_pictures_that_viewers_show(tmp_path):
    node = build(settings(tmp_path, frames="png"))
    feed(node, 0.5)
    node.close()
    data = [
        json.loads(m.data) for key, m in recorded(tmp_path / "flight.mcap") if key == "alight/v1/camera/frame/image"
    ]
    assert [entry["timestamp"]["nsec"] for entry in data] == [0, 100_000_000, 200_000_000, 300_000_000, 400_000_000]
    encoded = np.frombuffer(b64decode(data[3]["data"]), np.uint8)
    np.testing.assert_array_equal(cv2.imdecode(encoded, cv2.IMREAD_UNCHANGED), picture(3))


@pytest.mark.parametrize(("rate_hz", "kept"), [(0.0, 60), (10.0, 10), (20.0, 20), (7.0, 7)])
def test_rate_limit_spreads_the_pictures(tmp_path, rate_hz, kept):
    chooser = FrameChooser(settings(tmp_path, frame_rate_hz=rate_hz).recorder)
    stamps_ns = [LOCKSTEP_EPOCH_NS + number * NS_PER_S // 60 for number in range(60)]
    assert sum(chooser.wants(frame(0, stamp_ns)) for stamp_ns in stamps_ns) == kept


def test_pixels_that_are_no_picture_are_counted(tmp_path):
    node = build(settings(tmp_path))
    empty = np.zeros((0, 0), np.uint8)
    node.on_message(Arrival(topics.FRAME, frame(0), LOCKSTEP_EPOCH_NS, LOCKSTEP_EPOCH_NS, empty))
    node.close()
    assert (node.counters()["recorded"], node.counters()["pictures_refused"]) == (1, 1)


def test_health_of_a_service_nobody_knows_is_not_kept(tmp_path):
    node = build(settings(tmp_path))
    now_ns = LOCKSTEP_EPOCH_NS
    node.on_message(Arrival(topics.HEALTH, health(now_ns, "../../intruder"), now_ns, now_ns))
    node.close()
    assert (node.counters()["lost_unknown"], node.counters()["recorded"]) == (1, 0)


def test_same_flight_is_the_same_file_wherever_it_lies(tmp_path):
    for folder in ("here", "there"):
        feed(node := build(settings(tmp_path / folder)))
        node.close()
    assert (tmp_path / "here/flight.mcap").read_bytes() == (tmp_path / "there/flight.mcap").read_bytes()


def test_settings_seed_and_versions_are_in_the_file(tmp_path):
    build(settings(tmp_path)).close()
    with (tmp_path / "flight.mcap").open("rb") as file:
        reader = make_reader(file)
        attachment, metadata = next(reader.iter_attachments()), next(reader.iter_metadata())
    stored = json.loads(attachment.data)
    assert stored["seed"] == 3 and "directory" not in stored["recorder"]
    assert Settings.model_validate(stored).pad.id == 68
    assert {"alight", "python", "zenoh", "opencv", "schema", "seed"} <= set(metadata.metadata)


@pytest.mark.parametrize("compression", ["zstd", "lz4", "none"])
def test_what_was_ticked_can_be_read_though_the_file_was_never_finished(tmp_path, compression):
    node = build(settings(tmp_path, compression=compression))
    feed(node, 2.0)
    found = whole(tmp_path / "flight.mcap", Message)
    newest_ns = max(message.log_time for message in found)
    assert newest_ns >= LOCKSTEP_EPOCH_NS + 1.9 * NS_PER_S
    node.close()


def test_a_recorder_that_starts_again_does_not_overwrite(tmp_path):
    for _ in range(3):
        feed(node := build(settings(tmp_path)), 0.3)
        node.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["flight.mcap", "flight_2.mcap", "flight_3.mcap"]


def test_a_folder_that_cannot_be_written_is_one_clear_line(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(
        FlightFileError, match=r"^recorder\.directory: .*file/flight\.mcap cannot be written .*--set"
    ) as e:
        build(settings(tmp_path / "file"))
    assert "\n" not in str(e.value)


@contextmanager
def disk_that_fills_up_at(size_bytes: int) -> Iterator[None]:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_full_disk_ends_the_recording_but_not_the_recorder(tmp_path, monkeypatch):
    monkeypatch.setattr(flight_file, "_ROOM_TO_GO_ON_BYTES", 2**62)
    node = build(settings(tmp_path, compression="none", chunk_bytes=4096))
    with disk_that_fills_up_at(80_000):
        feed(node, 5.0)
        node.close()
    (complaint,) = node.complaints(LOCKSTEP_EPOCH_NS)
    assert "stopped: File too large" in complaint
    assert node.counters()["lost"] > 0
    kept = len(whole(tmp_path / "flight.mcap", Message))
    assert 0 < kept <= node.counters()["recorded"]


def test_a_recording_that_a_file_had_no_room_for_goes_on_in_the_next(tmp_path):
    node = build(settings(tmp_path, compression="none", chunk_bytes=4096))
    with disk_that_fills_up_at(80_000):
        feed(node, 5.0)
        node.close()
    assert node.counters()["parts"] == 2 and node.counters()["lost"] > 0
    metadata = {entry.name: entry.metadata for entry in whole(tmp_path / "flight_2.mcap", Metadata)}
    assert metadata["beginning"]["reason"] == "resumed" and int(metadata["beginning"]["lost_before"]) > 0


def test_replies_without_a_stamp_of_their_own_order_are_kept_in_order_of_arrival(tmp_path):
    node = build(settings(tmp_path))
    for number, stamp in enumerate((5, 3, 9)):
        reply = MissionReply(at_ns=stamp, request_id=str(number), accepted=True, reason="")
        node.on_message(Arrival(topics.REPLY, reply, LOCKSTEP_EPOCH_NS, LOCKSTEP_EPOCH_NS + number))
    node.close()
    kept = [m for key, m in recorded(tmp_path / "flight.mcap") if key == "alight/v1/commander/reply"]
    assert [(m.publish_time, m.sequence) for m in kept] == [(5, 0), (3, 1), (9, 2)]
