"""The recorder killed at any moment, and a disk that fills up: each file opens, holds all but the last second, says what is missing."""

import os
import random
import shutil
import signal
import subprocess
import time
from contextlib import ExitStack
from pathlib import Path

import pytest
from flight_process import flight
from mcap.writer import MCAP0_MAGIC
from recorder_process import recorder, recorder_command, traffic, wait_for_size

from alight.runtime.clock import NS_PER_S
from schemas import topics
from station.flight_record import FlightRecord, read_flight
from station.metrics.summary import summarise
from station.recording.doctor import problems_of
from station.recording.salvage import salvage

pytestmark = pytest.mark.system

KILLED, AT_ONCE = 10, 5
HARMLESS_MS = 1000.0
"""A publisher that is held up for longer than this by a dead recorder would be noticed in flight."""


def numbers(record: FlightRecord) -> list[int]:
    """Of the truths in a recording of `traffic.py`."""
    return [round(truth.vehicle_from_pad_ned_m[0]) for truth in record.messages(topics.GROUND_TRUTH)]


def waited_ns(pid: int) -> int:
    """How long the thread of a process that waited longest for a processor has waited for one, all told."""
    threads = Path(f"/proc/{pid}/task").glob("*/schedstat")
    return max(int(account.read_text().split()[1]) for account in threads)


def check_whole_but_for_the_end(path: Path, ended_at_ns: int, starved_ns: int = 0) -> None:
    """It opens, nothing lacks between its first message and its last, and it says so.

    The last is younger than a second, not counting the time for which other programs kept the recorder from running.
    """
    record = read_flight(path)
    kept = numbers(record)
    assert kept == list(range(kept[0], kept[-1] + 1))
    newest_ns = record.logged(topics.GROUND_TRUTH)[-1].logged_at_ns
    missing_ns = ended_at_ns - newest_ns
    assert missing_ns < NS_PER_S + starved_ns, f"the last {missing_ns / NS_PER_S:.2f} s are missing"
    frames = record.messages(topics.FRAME)
    assert frames[-1].captured_at_ns > newest_ns - NS_PER_S
    assert record.picture(record.picture_times_ns[-1]) is not None
    mended = path.with_name("mended.mcap")
    salvage(path, mended)
    assert problems_of(mended) == ([], [])
    assert numbers(read_flight(mended)) == kept


def test_killed_at_ten_random_moments(tmp_path: Path) -> None:
    moments = random.Random(20261122)
    with traffic(rate_hz=20.0) as published:
        for wave in range(KILLED // AT_ONCE):
            folders = [tmp_path / f"{wave}-{number}" for number in range(AT_ONCE)]
            ends = _record_and_kill(folders, published.endpoint, moments)
            for folder, (at_ns, starved_ns) in zip(folders, ends, strict=True):
                file = folder / "flight.mcap"
                (defect,) = read_flight(file).provenance.defects
                assert defect == "flight.mcap was not finished: what follows its last whole chunk is lost"
                check_whole_but_for_the_end(file, at_ns, starved_ns)
        assert published.end()["longest_ms"] < HARMLESS_MS


def _record_and_kill(folders: list[Path], endpoint: str, moments: random.Random) -> list[tuple[int, int]]:
    """When each recorder was killed, and for how long it had had to wait for a processor in the seconds before."""
    ends = []
    with ExitStack() as stack:
        running = [stack.enter_context(recorder(folder, endpoint)) for folder in folders]
        for folder in folders:
            wait_for_size(folder / "flight.mcap", 300_000)
        waited_before_ns = [waited_ns(process.pid) for process in running]
        for process, before_ns in zip(running, waited_before_ns, strict=True):
            time.sleep(moments.uniform(0.0, 0.6))
            starved_ns = waited_ns(process.pid) - before_ns
            process.send_signal(signal.SIGKILL)
            ends.append((time.time_ns(), starved_ns))
            process.wait()
    return ends


def test_a_recorder_that_stands_still_holds_nobody_up(tmp_path: Path) -> None:
    with traffic(rate_hz=200.0) as published, recorder(tmp_path / "now", published.endpoint) as process:
        wait_for_size(tmp_path / "now" / "flight.mcap", 300_000)
        process.send_signal(signal.SIGSTOP)
        time.sleep(4.0)
        process.send_signal(signal.SIGCONT)
        assert published.end()["longest_ms"] < HARMLESS_MS


NAMESPACE = ("unshare", "-m" if os.geteuid() == 0 else "-rm")


def _may_mount() -> bool:
    probe = [*NAMESPACE, "sh", "-c", "mount -t tmpfs -o size=1m tmpfs /mnt"]
    return (
        shutil.which("unshare") is not None and subprocess.run(probe, capture_output=True, check=False).returncode == 0
    )


@pytest.mark.skipif(not _may_mount(), reason="no file system may be mounted here, not even in a namespace of its own")
def test_a_file_system_of_20_mb_fills_up(tmp_path: Path) -> None:
    small = tmp_path / "small"
    small.mkdir()
    with traffic(rate_hz=30.0) as published:
        # Pixels through shared memory do not reach into another user's namespace.
        wanted = ['recorder.frames="raw"', "bus.shared_memory=false"]
        command = recorder_command(small / "now", published.endpoint, wanted)
        mount = 'mount -t tmpfs -o size=20m tmpfs "$0" && exec "$@"'
        with subprocess.Popen([*NAMESPACE, "sh", "-c", mount, str(small), *command]) as process:
            try:
                # The file system exists for the recorder alone; this is the way in.
                seen = Path(f"/proc/{process.pid}/root{small}/now/flight.mcap")
                full_at_ns = _wait_until_it_is_ended(seen)
                kept = tmp_path / "kept" / "flight.mcap"
                kept.parent.mkdir()
                shutil.copy(seen, kept)
                time.sleep(1.0)
                assert process.poll() is None, "the recorder goes on running"
                assert not list(seen.parent.glob("flight_2*")), "nothing is begun on a full disk"
            finally:
                process.terminate()
        assert published.end()["longest_ms"] < HARMLESS_MS
    assert kept.stat().st_size > 10_000_000
    assert problems_of(kept) == ([], []), "a file that the disk had no more room for is still ended in order"
    assert read_flight(kept).provenance.defects == ("flight.mcap ends before its time: No space left on device",)
    check_whole_but_for_the_end(kept, full_at_ns)


def _wait_until_it_is_ended(path: Path, timeout_s: float = 90.0) -> int:
    """When the recorder gave it its end, UTC ns."""
    until_s = time.monotonic() + timeout_s
    wait_for_size(path, 10_000_000)
    while time.monotonic() < until_s:
        with path.open("rb") as file:
            file.seek(-len(MCAP0_MAGIC), os.SEEK_END)
            if file.read() == MCAP0_MAGIC:
                return time.time_ns()
        time.sleep(0.02)
    raise AssertionError(f"{path} was not ended")


def test_a_flight_does_not_mind_the_death_of_its_recorder(tmp_path: Path) -> None:
    low = ("--set", "simulator.airborne={north_m=3.0, east_m=3.0, down_m=-10.0}")
    with flight(tmp_path / "flight", low) as running:
        running.wait_for_line(lambda line: "-> descend" in line)
        os.kill(running.pid_of("recorder"), signal.SIGKILL)
        status = running.wait()
    assert status == 0, running.output
    record = read_flight(tmp_path / "flight")
    assert summarise(record).verdict.ok
    cut, pause = record.provenance.defects
    assert cut == "flight.mcap was not finished: what follows its last whole chunk is lost"
    assert pause.startswith("nothing was recorded for ") and pause.endswith(" between flight.mcap and flight_2.mcap")
