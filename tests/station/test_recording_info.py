"""`alight recording info`: counts, rates, and what is missing, from the numbers that messages carry."""

import json

import pytest
from short_recording import short_recording
from synthetic_flight import START_NS

from alight.runtime.clock import NS_PER_S
from schemas import topics
from schemas.frame import FrameHeader
from schemas.settings import Settings
from services.recorder.entries import EntryMaker
from services.recorder.flight_file import FlightFile
from station.__main__ import main
from station.flight_record import read_flight
from station.mcap_parts import PartsReader
from station.recording.inventory import gaps, take_inventory


def frame(number: int) -> FrameHeader:
    at_ns = START_NS + number * NS_PER_S // 10
    return FrameHeader(captured_at_ns=at_ns, sequence=number, width_px=4, height_px=2, source="test")


def test_topics_counts_and_rates_are_listed(tmp_path, capsys):
    path = short_recording(tmp_path)
    assert main(["recording", "info", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "nothing is missing" in said and "seed 7" in said
    assert main(["recording", "info", "--json", str(path)]) == 0
    facts = json.loads(capsys.readouterr().out)
    truth = next(channel for channel in facts["channels"] if channel["name"] == "truth")
    assert truth["messages"] == len(read_flight(path).messages(topics.GROUND_TRUTH)) == 120
    assert facts["missing"] == [] and facts["parts"][0]["ending"]["reason"] == "stopped"


def test_what_never_came_and_what_was_not_written_are_told_apart(tmp_path):
    settings = Settings.model_validate({"recorder": {"directory": tmp_path}})
    file, entries = FlightFile(settings), EntryMaker(settings)
    for number in range(20):
        if number in (3, 4):  # lost on the bus
            continue
        at_ns = frame(number).captured_at_ns
        entry = entries.of_message(topics.FRAME, frame(number), at_ns, at_ns)
        if entry is not None and number not in (10, 11, 12):  # lost on the way to the disk
            file.add(entry)
    file.finish()
    inventory = take_inventory(PartsReader(tmp_path / "flight.mcap"))
    frames = inventory.channels["camera/frame"]
    assert (frames.messages, frames.not_written, frames.not_received) == (15, 3, 2)
    assert frames.longest_gap_ns == 4 * NS_PER_S // 10
    assert list(gaps(inventory)) == [
        "3 messages of camera/frame reached the recorder and are not in the file",
        "2 messages of camera/frame were published and never reached the recorder",
    ]


def test_what_is_no_recording_is_one_clear_line(tmp_path, capsys):
    assert main(["recording", "info", str(tmp_path)]) == 1
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("begun", [0, 4, 8, 100])
def test_a_recording_without_a_message_is_none(tmp_path, capsys, begun):
    stub = tmp_path / "stub.mcap"
    stub.write_bytes(short_recording(tmp_path).read_bytes()[:begun])
    assert main(["recording", "info", str(stub)]) == 1
    said = capsys.readouterr()
    assert f"{stub}: holds no messages" in said.err and said.err.count("\n") == 1 and not said.out
