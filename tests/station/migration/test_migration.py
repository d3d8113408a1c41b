"""Recordings of older schema versions: read as if recorded today; newer ones are refused with both versions named."""

import json
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer

from schemas import topics
from schemas.message import SCHEMA_VERSION
from schemas.topics import BY_NAME
from services.recorder import layout
from station.flight_record import read_flight
from station.mcap_parts import FlightRecordError
from station.metrics.summary import summarise
from station.migration.chain import OLDEST_VERSION, STEPS, MigrationError, migrated, recorded_as
from station.report.write import write_report

VERSION_1 = Path(__file__).parents[1] / "recordings" / "version_1.mcap"
"""A short lockstep landing, flown and recorded by the last release with schema version 1 (commit 155eb31)."""

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=6,
)


def recorded_in_version_1() -> list[tuple[str, str, bytes]]:
    """Topic, wire encoding and text of every message in the old recording, read without any code of ours."""
    with VERSION_1.open("rb") as file:
        return [
            (channel.metadata[layout.TOPIC], channel.metadata[layout.WIRE_ENCODING], message.data)
            for _, channel, message in make_reader(file).iter_messages()
            if layout.TOPIC in channel.metadata
        ]


def test_every_old_message_is_read_with_all_that_it_said():
    old = recorded_in_version_1()
    record = read_flight(VERSION_1)
    assert record.provenance.defects == ()
    assert record.provenance.versions["schema"] == "1"
    for name, count in Counter(topic for topic, _, _ in old).items():
        assert len(record.messages(BY_NAME[name])) == count, name
    for topic, encoding, text in old:
        message, version = recorded_as(encoding)
        now = json.loads(migrated(message, version, text))
        before = json.loads(text)
        assert {key: now[key] for key in before} == before
        read = BY_NAME[topic].message.model_validate(now)
        assert json.loads(read.model_dump_json(exclude_none=True)) | before == json.loads(
            read.model_dump_json(exclude_none=True)
        )


def test_an_old_flight_is_summed_up_and_reported_by_todays_code(tmp_path):
    record = read_flight(VERSION_1)
    summary = summarise(record)
    assert summary.verdict.ok
    write_report(record, summary, tmp_path / "report.html")
    assert (tmp_path / "report.html").stat().st_size > 10_000
    assert len(record.picture_times_ns) == 4


@pytest.mark.parametrize("version", [SCHEMA_VERSION + 1, SCHEMA_VERSION + 70, 0])
def test_an_unknown_version_is_refused_naming_both(version, tmp_path):
    path = tmp_path / "flight.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("alight.PadFix", "jsonschema", b"{}")
        about = {layout.TOPIC: topics.PAD_FIX.name, layout.WIRE_ENCODING: f"application/json;alight.PadFix.v{version}"}
        channel = writer.register_channel("alight/v1/geolocator/fix", "json", schema, about)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()
    with pytest.raises(FlightRecordError) as refused:
        read_flight(path)
    said = str(refused.value)
    assert str(path) in said and "\n" not in said
    assert f"schema version {version}," in said
    assert f"versions {OLDEST_VERSION} to {SCHEMA_VERSION}" in said


def test_the_chain_has_one_step_for_every_version_up_to_this_one():
    assert [step.from_version for step in STEPS] == list(range(OLDEST_VERSION, SCHEMA_VERSION))


def test_what_names_no_message_is_left_to_the_reader_to_count():
    assert recorded_as("") is None
    assert recorded_as("text/plain") is None
    assert recorded_as("application/json;foxglove.CompressedImage") is None


@given(st.integers(min_value=SCHEMA_VERSION + 1, max_value=10**9))
def test_no_newer_version_is_taken_for_a_known_one(version):
    with pytest.raises(MigrationError, match=f"version {version}, .* to {SCHEMA_VERSION}"):
        recorded_as(f"application/json;alight.Detection.v{version}")


@given(st.sampled_from(sorted({change for step in STEPS for change in step.changes})), st.dictionaries(st.text(), JSON))
def test_a_step_takes_any_object_and_does_nothing_the_second_time(message, content):
    for step in STEPS:
        change = step.changes.get(message, lambda same: same)
        before = json.dumps(content)
        once = change(content)
        assert change(once) == once
        assert json.dumps(content) == before, "a step must not change what it is given"


@given(st.sampled_from([topic.message.__name__ for topic in topics.TOPICS]), st.binary(max_size=40))
def test_a_message_of_this_version_is_not_touched(message, text):
    assert migrated(message, SCHEMA_VERSION, text) == text


@given(st.sampled_from(recorded_in_version_1()))
def test_migrating_a_migrated_message_changes_nothing(old):
    _, encoding, text = old
    message, version = recorded_as(encoding)
    once = migrated(message, version, text)
    assert json.loads(migrated(message, version, once)) == json.loads(once)
