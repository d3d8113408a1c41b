"""A recording read back: whole, unfinished, in parts, damaged, or not one at all."""

import numpy as np
import pytest
from synthetic_flight import START_NS, Flight

from schemas import topics
from station.flight_record import read_flight
from station.mcap_parts import FlightRecordError


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return Flight(paint_every=2, abort_at_s=2.0).write(tmp_path_factory.mktemp("flight"))


def test_every_message_comes_back_as_it_was(recording):
    said = Flight(abort_at_s=2.0).spoken()
    record = read_flight(recording)
    for topic in topics.TOPICS:
        expected = [(one.at_ns, one.message) for one in said if one.topic is topic]
        assert [(one.logged_at_ns, one.message) for one in record.logged(topic)] == expected, topic.name
        assert record.messages(topic) == tuple(message for _, message in expected)
    assert record.provenance.defects == ()


def test_settings_and_versions_come_back(recording):
    record = read_flight(recording.parent)
    assert record.setting("pad", "id", None) == 68
    assert record.setting("pad", "colour", "black") == "black"
    assert record.provenance.versions["seed"] == "7"


def test_pictures_are_decoded_on_demand(recording):
    record = read_flight(recording)
    frames = record.messages(topics.FRAME)
    assert record.picture_times_ns == tuple(frame.captured_at_ns for frame in frames[::2])
    picture = record.picture(record.picture_times_ns[30])
    assert picture is not None and picture.shape == (480, 640) and picture.dtype == np.uint8
    assert record.picture(START_NS - 1) is None


@pytest.mark.parametrize("kept", [0.3, 0.6, 0.99])
def test_a_recording_cut_short_yields_its_beginning(recording, tmp_path, kept):
    data = recording.read_bytes()
    cut = tmp_path / "flight.mcap"
    cut.write_bytes(data[: int(len(data) * kept)])
    record, whole = read_flight(cut), read_flight(recording)
    truths = record.messages(topics.GROUND_TRUTH)
    assert len(truths) > 0 and truths == whole.messages(topics.GROUND_TRUTH)[: len(truths)]
    assert record.provenance.defects == ("flight.mcap was not finished: what follows its last whole chunk is lost",)
    assert record.picture(record.picture_times_ns[-1]) is not None


def test_a_damaged_chunk_costs_only_itself(recording, tmp_path):
    data = bytearray(recording.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 40] = bytes(40)
    broken = tmp_path / "flight.mcap"
    broken.write_bytes(data)
    record = read_flight(broken)
    assert any("damaged chunk" in defect for defect in record.provenance.defects)
    assert len(record.messages(topics.GROUND_TRUTH)) > 100


def test_parts_of_a_restarted_recorder_are_one_flight(tmp_path):
    flight = Flight(abort_at_s=1.0)
    flight.write(tmp_path)
    flight.write(tmp_path)
    (tmp_path / "flight_3.mcap").touch()  # a recorder that was killed before its first byte
    assert read_flight(tmp_path).provenance.defects == (
        "flight_3.mcap was not finished: what follows its last whole chunk is lost",
    )
    assert len(read_flight(tmp_path).messages(topics.GROUND_TRUTH)) == 2 * len(
        flight.record().messages(topics.GROUND_TRUTH)
    )


def test_what_is_not_a_recording_is_refused_in_one_line(tmp_path):
    with pytest.raises(FlightRecordError, match="no such recording"):
        read_flight(tmp_path / "nothing.mcap")
    (tmp_path / "text.mcap").write_text("this is not an MCAP file at all")
    with pytest.raises(FlightRecordError, match="not an MCAP recording"):
        read_flight(tmp_path / "text.mcap")
