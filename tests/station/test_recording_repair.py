"""`alight recording repair`: everything that is whole is saved, the file is right to the letter, and says what is lost."""

import fcntl

import pytest
from mcap.opcode import Opcode
from short_recording import short_recording

from schemas import topics
from station.__main__ import main
from station.flight_record import read_flight
from station.recording.doctor import problems_of
from station.recording.mcap_records import records


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return short_recording(tmp_path_factory.mktemp("flight"))


@pytest.mark.parametrize("kept", [0.5, 0.9, 0.999])
def test_a_recording_cut_short_becomes_a_whole_one(recording, tmp_path, capsys, kept):
    cut = tmp_path / "flight.mcap"
    cut.write_bytes(recording.read_bytes()[: int(recording.stat().st_size * kept)])
    before = read_flight(cut)
    assert main(["recording", "repair", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "messages saved" in said and "lost: " in said
    assert problems_of(cut) == ([], [])
    after = read_flight(cut)
    assert all(after.logged(topic) == before.logged(topic) for topic in topics.TOPICS)
    assert after.picture_times_ns == before.picture_times_ns
    assert after.provenance.versions == before.provenance.versions
    assert after.provenance.settings == before.provenance.settings
    (defect,) = after.provenance.defects
    assert (defect.startswith("flight.mcap was mended: ") and "was not finished" in defect) or "its index" in defect
    assert (tmp_path / "flight.mcap.broken").stat().st_size == int(recording.stat().st_size * kept)


def test_a_whole_recording_is_left_alone(recording, capsys):
    before = recording.read_bytes()
    assert main(["recording", "repair", str(recording)]) == 0
    assert "nothing to repair" in capsys.readouterr().out
    assert recording.read_bytes() == before and len(list(recording.parent.glob("*"))) == 1


def test_a_damaged_chunk_is_left_out_and_named(recording, tmp_path, capsys):
    data = bytearray(recording.read_bytes())
    second = [record for record in records(memoryview(bytes(data))[:-8], 8) if record.opcode == Opcode.CHUNK][1]
    data[second.offset + 100 : second.offset + 140] = bytes(40)
    broken, mended = tmp_path / "broken.mcap", tmp_path / "mended.mcap"
    broken.write_bytes(data)
    assert main(["recording", "repair", str(broken), "--out", str(mended)]) == 0
    assert "lost: a damaged chunk at byte" in capsys.readouterr().out
    assert problems_of(mended) == ([], [])
    assert broken.read_bytes() == data
    assert len(read_flight(mended).messages(topics.GROUND_TRUTH)) > 50


def test_a_damaged_index_is_made_anew(recording, capsys, tmp_path):
    data = bytearray(recording.read_bytes())
    data[-100:-60] = bytes(40)
    (tmp_path / "flight.mcap").write_bytes(data)
    assert main(["recording", "repair", str(tmp_path)]) == 0
    assert "lost: its index" in capsys.readouterr().out
    assert problems_of(tmp_path / "flight.mcap") == ([], [])


def test_a_place_that_cannot_be_written_is_named_and_not_the_recording(recording, tmp_path, capsys):
    out = tmp_path / "nowhere" / "mended.mcap"
    assert main(["recording", "repair", str(recording), "--out", str(out)]) == 1
    assert f"--out {out}: No such file or directory: choose another folder\n" in capsys.readouterr().err


def test_nothing_is_overwritten(recording, tmp_path, capsys):
    cut, other = tmp_path / "flight.mcap", tmp_path / "other.mcap"
    cut.write_bytes(recording.read_bytes()[:-100])
    other.write_text("mine")
    assert main(["recording", "repair", str(cut), "--out", str(other)]) == 1
    (tmp_path / "flight.mcap.broken").write_text("mine")
    assert main(["recording", "repair", str(cut)]) == 1
    assert other.read_text() == (tmp_path / "flight.mcap.broken").read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["flight.mcap", "flight.mcap.broken", "other.mcap"]
    said = capsys.readouterr().err
    assert "other.mcap: is there already" in said and "there is a flight.mcap.broken already" in said


def test_what_a_recorder_still_writes_is_refused(recording, tmp_path, capsys):
    cut = tmp_path / "flight.mcap"
    cut.write_bytes(recording.read_bytes()[:-100])
    with cut.open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert main(["recording", "repair", str(cut)]) == 1
    assert "still writing" in capsys.readouterr().err


@pytest.mark.parametrize("begun", [0, 4, 8, 100])
def test_a_file_without_a_message_is_left_alone(recording, tmp_path, capsys, begun):
    stub = tmp_path / "flight.mcap"
    stub.write_bytes(recording.read_bytes()[:begun])
    for more in ([], ["--out", str(tmp_path / "mended.mcap")]):
        assert main(["recording", "repair", str(stub), *more]) == 1
        said = capsys.readouterr()
        assert (
            "holds no messages" in said.err and "--out" not in said.err and said.err.count("\n") == 1 and not said.out
        )
    assert stub.stat().st_size == begun and list(tmp_path.iterdir()) == [stub]


def test_what_is_no_recording_is_refused(tmp_path, capsys):
    (tmp_path / "text.mcap").write_text("this is not an MCAP file at all")
    assert main(["recording", "repair", str(tmp_path / "text.mcap")]) == 1
    assert "not an MCAP recording" in capsys.readouterr().err
    assert main(["recording", "repair", str(tmp_path / "nothing")]) == 1
