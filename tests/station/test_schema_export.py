"""The exported contract: complete, described to the last field, accepting real messages and refusing broken ones."""

import argparse
import copy
import functools
import json
from collections.abc import Iterator

import jsonschema
import pytest
import zenoh
from synthetic_flight import Flight

from alight.runtime.bus import configuration
from schemas import topics
from schemas.journal import EntryKind, Journal, JournalEntry
from schemas.settings import Settings
from schemas.wire import MAX_JSON_BYTES, encode, encoding_of
from station.schema_export import add_arguments, run, schema_file


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    directory = tmp_path_factory.mktemp("schemas") / "new" / "folder"
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    assert run(parser.parse_args([str(directory)])) == 0
    return {path.name: json.loads(path.read_text()) for path in directory.iterdir()}


JOURNAL = Journal(
    at_ns=2,
    service="filter",
    started_at_ns=1,
    number=0,
    entries=(JournalEntry(kind=EntryKind.TICK, received_at_ns=2, now_ns=2),),
)


@functools.cache
def message_of(topic):
    """The first that was said in a flight; no journal is kept in a synthetic one."""
    said = Flight().spoken()
    return JOURNAL if topic is topics.JOURNAL else next(one.message for one in said if one.topic is topic)


def real_message(topic) -> dict:
    message = message_of(topic)
    wire = encode(topic, message, b"" if topic.has_pixels else None)
    return json.loads(wire.attachment if topic.has_pixels else wire.payload)


def test_index_names_every_topic_and_its_schema(exported):
    index = exported["topics.json"]["topics"]
    assert [row["name"] for row in index] == [topic.name for topic in topics.TOPICS]
    assert {row["schema"] for row in index} | {"topics.json"} == set(exported)
    for row, topic in zip(index, topics.TOPICS, strict=True):
        assert row["encoding"] == encoding_of(topic)
        assert row["publishers"] == sorted(topic.publishers) and row["readers"] == sorted(topic.readers)
    frame = index[0]
    assert frame["key_expression"] == "alight/{vehicle}/camera/frame"
    assert frame["payload"].startswith("raw pixels") and frame["attachment"] == "the message as JSON"


def test_index_says_how_to_join_the_bus_and_what_is_refused_there(exported):
    index, defaults = exported["topics.json"], Settings()
    assert index["alive_key_expression"] == "alight/{vehicle}/alive/{service}"
    assert index["default_vehicle"] == defaults.vehicle
    assert index["max_clock_skew_s"] == defaults.bus.max_clock_skew_s and index["max_message_bytes"] == MAX_JSON_BYTES
    theirs = zenoh.Config()
    for key, value in index["zenoh_configuration"].items():
        theirs.insert_json5(key, json.dumps(value))
    assert str(theirs) == str(configuration(defaults.bus))


@pytest.mark.parametrize("topic", topics.TOPICS, ids=lambda topic: topic.name)
def test_the_field_that_age_and_order_are_judged_by_is_named(exported, topic):
    row = next(row for row in exported["topics.json"]["topics"] if row["name"] == topic.name)
    message = message_of(topic)
    assert getattr(message, row["stamp"]) == message.stamp_ns


def undescribed(schema: object, path: str) -> Iterator[str]:
    if isinstance(schema, dict):
        for name, field in schema.get("properties", {}).items():
            if not field.get("description"):
                yield f"{path}.{name}"
        for name, inner in schema.items():
            yield from undescribed(inner, f"{path}.{name}")
    elif isinstance(schema, list):
        for number, inner in enumerate(schema):
            yield from undescribed(inner, f"{path}[{number}]")


@pytest.mark.parametrize("topic", topics.TOPICS, ids=lambda topic: topic.name)
def test_every_field_is_described(exported, topic):
    assert list(undescribed(exported[schema_file(topic)], topic.name)) == []


@pytest.mark.parametrize("topic", topics.TOPICS, ids=lambda topic: topic.name)
def test_schema_accepts_a_real_message_and_refuses_broken_ones(exported, topic):
    schema = exported[schema_file(topic)]
    jsonschema.Draft202012Validator.check_schema(schema)
    message = real_message(topic)
    jsonschema.validate(message, schema)
    first = next(iter(schema["required"]))
    for broken in (_without(message, first), {**message, "surprise": 1}, {**message, first: "not a time"}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(broken, schema)


def _without(message: dict, field: str) -> dict:
    shorter = copy.deepcopy(message)
    del shorter[field]
    return shorter


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    assert run(parser.parse_args([str(tmp_path / "file" / "below")])) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "choose another folder" in said


def test_a_folder_of_code_is_left_alone(tmp_path, capsys):
    (tmp_path / "__init__.py").write_text("")
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    assert run(parser.parse_args([str(tmp_path)])) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "choose another folder" in said
    assert [path.name for path in tmp_path.iterdir()] == ["__init__.py"]
