"""Recordings of older schema versions: read as if recorded today; newer ones are refused with both versions named."""

import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer

from alight.runtime.settings_file import load_settings
from schemas import topics
from schemas.message import SCHEMA_VERSION
from schemas.topics import BY_NAME
from services.recorder import layout
from services.recorder.viewer_schema import viewer_schema
from station.__main__ import main
from station.flight_record import read_flight
from station.mcap_parts import FlightRecordError
from station.metrics.summary import summarise
from station.migration import chain
from station.migration.chain import OLDEST_VERSION, STEPS, MigrationError, migrated, recorded_as
from station.migration.step import Step
from station.migration.v1_to_v2 import V1_TO_V2
from station.replay.recording import ReplayRecording
from station.replay.replay import replay
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


def says_all_of(before: object, now: object) -> bool:
    """Whether everything that was said once is still said; more may be said, at any depth."""
    if isinstance(before, dict):
        return isinstance(now, dict) and all(key in now and says_all_of(before[key], now[key]) for key in before)
    if isinstance(before, list):
        return isinstance(now, list) and len(before) == len(now) and all(map(says_all_of, before, now))
    return before == now


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
        assert says_all_of(before, json.loads(read.model_dump_json()))


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


RENAMED = Step(1, {"Note": lambda note: {"text" if key == "words" else key: value for key, value in note.items()}})
SPLIT = Step(2, {"Note": lambda note: {"lines": str(note["text"]).split("/")} if "text" in note else note})
"""Steps as a later version might need them: a field renamed, then one that becomes a list."""


@pytest.mark.parametrize("step", [*STEPS, RENAMED, SPLIT])
@given(content=st.dictionaries(st.text() | st.sampled_from(["words", "text"]), JSON))
def test_a_step_takes_any_object_and_does_nothing_the_second_time(step, content):
    before = json.dumps(content)
    for change in step.changes.values():
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


@pytest.mark.parametrize(
    ("version", "text", "expected"),
    [(1, b'{"words": "a/b"}', {"lines": ["a", "b"]}), (2, b'{"text": "a/b"}', {"lines": ["a", "b"]}), (3, b"{}", {})],
)
def test_every_step_from_the_recorded_version_on_is_taken_in_order(monkeypatch, version, text, expected):
    monkeypatch.setattr(chain, "STEPS", (RENAMED, SPLIT))
    assert json.loads(migrated("Note", version, text)) == expected
    assert migrated("Other", version, text) == text


@pytest.mark.parametrize("text", [b"", b"[1]", b"{", b"7"])
def test_what_is_no_object_is_an_error_of_this_message_alone(monkeypatch, text):
    monkeypatch.setattr(chain, "STEPS", (RENAMED, SPLIT))
    with pytest.raises(ValueError):
        migrated("Note", 1, text)


def test_whatever_version_1_could_say_can_be_read_today():
    """By the schemas in the old recording itself; fails for a change that makes a step necessary."""
    with VERSION_1.open("rb") as file:
        summary = make_reader(file).get_summary()
    for channel in summary.channels.values():
        topic = BY_NAME.get(channel.metadata.get(layout.TOPIC, ""))
        if topic is not None and topic.message.__name__ not in V1_TO_V2.changes:
            then = json.loads(summary.schemas[channel.schema_id].data)
            narrower = list(narrowed(then, viewer_schema(topic.message), topic.message.__name__))
            assert not narrower, f"station/migration/v1_to_v2.py must change {narrower}"


def narrowed(then: dict, now: dict, where: str) -> Iterator[str]:
    """Where a schema allows less than it did."""
    if then.get("type") != now.get("type"):
        yield f"{where}: {then.get('type')} became {now.get('type')}"
    yield from (
        f"{where}.{name} is required now" for name in set(now.get("required", ())) - set(then.get("required", ()))
    )
    yield from (f"{where}: no {value} any more" for value in set(then.get("enum", ())) - set(now.get("enum", ())))
    for bound, sign in (("minimum", 1), ("minItems", 1), ("maximum", -1), ("maxItems", -1), ("maxLength", -1)):
        if bound in now and sign * now[bound] > sign * then.get(bound, -sign * float("inf")):
            yield f"{where}: {bound} {now[bound]}"
    for name, field in then.get("properties", {}).items():
        if name in now.get("properties", {}):
            yield from narrowed(field, now["properties"][name], f"{where}.{name}")
        else:
            yield f"{where}.{name} is gone"
    if "items" in then and "items" in now:
        yield from narrowed(then["items"], now["items"], f"{where}[]")


def test_a_migrated_file_is_of_this_version_to_the_letter_and_says_the_same(tmp_path, capsys):
    out = tmp_path / "migrated.mcap"
    assert main(["recording", "migrate", str(VERSION_1), "--out", str(out)]) == 0
    assert main(["recording", "doctor", str(out)]) == 0, capsys.readouterr().out
    with out.open("rb") as file:
        encodings = {
            channel.metadata.get(layout.WIRE_ENCODING) for channel in make_reader(file).get_summary().channels.values()
        }
    assert {encoding.rsplit(".v", 1)[-1] for encoding in encodings if encoding} == {str(SCHEMA_VERSION)}
    old, new = read_flight(VERSION_1), read_flight(out)
    assert all(old.logged(topic) == new.logged(topic) for topic in topics.TOPICS)
    assert new.provenance.settings == old.provenance.settings
    assert (new.picture(new.picture_times_ns[0]) == old.picture(old.picture_times_ns[0])).all()

    assert main(["recording", "migrate", str(VERSION_1), "--out", str(out)]) == 2
    assert "nothing is overwritten" in capsys.readouterr().err


def test_a_chunk_that_was_overwritten_is_damage(tmp_path, capsys):
    data = bytearray(VERSION_1.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 2000] = bytes(2000)
    (tmp_path / "holed.mcap").write_bytes(data)
    assert main(["recording", "migrate", str(tmp_path / "holed.mcap"), "--out", str(tmp_path / "out.mcap")]) == 2
    assert "holed.mcap: not finished, or damaged; `alight" in capsys.readouterr().err


def test_what_cannot_be_read_or_written_is_named(tmp_path, capsys):
    out, missing = tmp_path / "nowhere" / "migrated.mcap", tmp_path / "missing.mcap"
    assert main(["recording", "migrate", str(VERSION_1), "--out", str(out)]) == 2
    assert f"--out {out}: No such file or directory: choose another folder" in capsys.readouterr().err
    assert main(["recording", "migrate", str(missing), "--out", str(tmp_path / "migrated.mcap")]) == 2
    assert f"{missing}: no such recording" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("kept", [0.0, 0.3, 0.9])
def test_a_damaged_file_is_not_migrated_but_sent_to_repair(tmp_path, capsys, kept):
    data = VERSION_1.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: int(len(data) * kept)])
    out = tmp_path / "migrated.mcap"
    assert main(["recording", "migrate", str(tmp_path / "cut.mcap"), "--out", str(out)]) == 2
    assert "cut.mcap: not finished, or damaged; `alight recording repair` first" in capsys.readouterr().err
    assert not out.exists()


def test_an_old_flight_is_replayed_by_todays_nodes():
    recorded = {fix.captured_at_ns: fix for fix in read_flight(VERSION_1).messages(topics.PAD_FIX)}
    result = replay(ReplayRecording(VERSION_1), ("geolocator", "filter"))
    fixes = [output.message for output in result.of(topics.PAD_FIX.name)]
    assert {fix.captured_at_ns for fix in fixes} == set(recorded) and len(recorded) > 50
    located = [(fix, recorded[fix.captured_at_ns]) for fix in fixes if recorded[fix.captured_at_ns].corrected]
    assert len(located) > 15
    for now, then in located:
        assert now.corrected.pad_ned_m == pytest.approx(then.corrected.pad_ned_m, abs=1e-3)


def test_the_settings_of_an_old_flight_are_printed_for_todays_services(tmp_path, capsys):
    assert main(["recording", "settings", str(VERSION_1)]) == 0
    path = tmp_path / "settings.json"
    path.write_text(capsys.readouterr().out)
    assert load_settings(path).camera.calibration.width_px == 320
