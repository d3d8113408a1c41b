"""`alight recording doctor`: it passes what the recorder writes, and finds each fault that is put in."""

import json
import shutil
import struct
import subprocess
import zlib
from pathlib import Path

import pytest
from mcap.writer import Writer
from short_recording import short_recording

from station.__main__ import main
from station.recording.doctor import problems_of
from station.recording.mcap_records import records


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return short_recording(tmp_path_factory.mktemp("flight"))


def test_what_the_recorder_writes_is_right_to_the_letter(recording, capsys):
    assert problems_of(recording) == ([], [])
    assert main(["recording", "doctor", str(recording)]) == 0
    assert "0 errors, 0 warnings" in capsys.readouterr().out


@pytest.mark.skipif(shutil.which("mcap") is None, reason="the mcap command is not installed")
def test_the_mcap_command_says_so_too(recording):
    examined = subprocess.run(["mcap", "doctor", str(recording)], capture_output=True, text=True, check=False)
    assert examined.returncode == 0, examined.stdout + examined.stderr


def patched(source: Path, target: Path, offset: int, data: bytes) -> Path:
    content = bytearray(source.read_bytes())
    content[offset : offset + len(data)] = data
    target.write_bytes(content)
    return target


@pytest.mark.parametrize(
    ("opcode", "at", "data", "said"),
    [
        (0x06, 9 + 24, b"\0\0\0\1", "wrong checksum"),  # chunk: its checksum
        (0x06, 9, bytes(8), "other times than its messages"),  # chunk: earliest time
        (0x07, 9 + 2 + 4 + 8, bytes(8), "does not fit its chunk"),  # message index: an offset
        (0x08, 9 + 16, b"\1", "index of chunks"),  # chunk index: where the chunk begins
        (0x09, 60, b"#", "attachment"),  # attachment: a letter of it
        (0x0B, 9, b"\1", "statistics"),  # statistics: the count
        (0x0E, 10, b"\1", "summary's offset"),  # summary offset: where the group begins
    ],
)
def test_a_wrong_number_is_found(recording, tmp_path, opcode, at, data, said):
    content = memoryview(recording.read_bytes())
    place = next(record for record in records(content[:-8], 8) if record.opcode == opcode)
    broken = patched(recording, tmp_path / "flight.mcap", place.offset + at, data)
    problems, _ = problems_of(broken)
    assert any(said in problem for problem in problems), problems


def test_a_wrong_checksum_of_the_summary_is_found(recording, tmp_path):
    size = recording.stat().st_size
    broken = patched(recording, tmp_path / "flight.mcap", size - 8 - 4, struct.pack("<I", zlib.crc32(b"other")))
    assert problems_of(broken)[0] == ["the summary has a wrong checksum"]


def test_a_file_cut_short_is_found(recording, tmp_path, capsys):
    cut = tmp_path / "flight.mcap"
    cut.write_bytes(recording.read_bytes()[:-200])
    assert main(["recording", "doctor", str(cut)]) == 1
    assert "it was not finished" in capsys.readouterr().out


def test_messages_that_break_their_schema_are_found(tmp_path):
    path = tmp_path / "other.mcap"
    schema = {"type": "object", "properties": {"a": {"type": "integer"}}}
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(library="test")
        channel = writer.register_channel(
            "k", "json", writer.register_schema("A", "jsonschema", json.dumps(schema).encode())
        )
        image = writer.register_channel("camera/frame/image", "json", 0)
        for number, text in enumerate((b'{"a": 1}', b'{"a": "one"}', b'{"a": "two"}', b"{")):
            writer.add_message(channel, number, text, number)
        writer.add_message(image, 9, b'{"data": "no picture"}', 9)
        writer.finish()
    problems, _ = problems_of(path)
    assert problems == [
        "k: $.a: 'one' is not of type 'integer' (1 times)",
        "k: $.a: 'two' is not of type 'integer' (1 times)",
        "k: not JSON (1 times)",
        "camera/frame/image: not a picture (1 times)",
        "camera/frame/image: JSON without a JSON Schema (1 times)",
    ]
