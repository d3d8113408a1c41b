"""A flight that crashes, hangs or loses its process is a result; the next one flies on."""

import contextlib
import os
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from station.campaign.cell_process import CellProcess
from station.campaign.draw import FlightTasks
from station.campaign.flight_task import FlightTask
from station.campaign.fly_task import fly_task
from station.campaign.software import software
from station.campaign.spec import read_spec

pytestmark = pytest.mark.system

SPEC = Path(__file__).parents[2] / "station" / "campaign" / "examples" / "thousand.toml"
LIMIT_S = 120.0


@pytest.fixture
def cell() -> Iterator[CellProcess]:
    process = CellProcess()
    yield process
    process.close()


@pytest.fixture(scope="module")
def task() -> FlightTask:
    return FlightTasks(read_spec(SPEC, flights=2), SPEC)[1]


def without_marker(task: FlightTask) -> FlightTask:
    """A flight whose camera cannot be built."""
    pad = task.settings.pad.model_copy(update={"id": 5000})
    return task.model_copy(update={"settings": task.settings.model_copy(update={"pad": pad})})


def test_a_cell_flies_what_this_process_flies_with_and_without_a_recording(
    cell: CellProcess, task: FlightTask, tmp_path: Path
) -> None:
    row = cell.fly(task, LIMIT_S)
    assert cell.software == software()
    assert row["landed"]
    assert row["touchdown_error_m"] < 0.5
    assert row == fly_task(task.model_copy(update={"record_in": str(tmp_path / "recorded")}))
    assert (tmp_path / "recorded" / "flight.mcap").stat().st_size > 10_000


def test_after_a_crash_and_a_hang_the_next_flight_flies(cell: CellProcess, task: FlightTask) -> None:
    crashed = cell.fly(without_marker(task), LIMIT_S)
    assert (crashed["outcome"], crashed["landed"], crashed["index"]) == ("crashed", False, task.index)
    assert "5000" in crashed["reason"]
    hung = cell.fly(task, 0.05)
    assert (hung["outcome"], hung["reason"]) == ("timed_out", "hung: no end after 0.05 s of work")
    assert hung.keys() == crashed.keys() == cell.fly(task, LIMIT_S).keys()


@pytest.mark.parametrize("times", [1, 2])
def test_a_cell_killed_from_outside_flies_again_once(
    cell: CellProcess, task: FlightTask, tmp_path: Path, times: int
) -> None:
    recorded = task.model_copy(update={"record_in": str(tmp_path / "recorded")})
    killer = threading.Thread(target=kill_in_flight, args=(tmp_path / "recorded" / "flight.mcap", times))
    killer.start()
    row = cell.fly(recorded, LIMIT_S)
    killer.join()
    if times == 1:
        assert row["landed"]
        assert [path.name for path in (tmp_path / "recorded").iterdir()] == ["flight.mcap"]
    else:
        assert (row["outcome"], row["reason"]) == ("crashed", "its process died of SIGKILL")


def kill_in_flight(recording: Path, times: int) -> None:
    """Kill the cell when its flight is under way, which the growing recording tells, and the next one likewise."""
    killed: dict[int, int] = {}
    deadline_s = time.monotonic() + LIMIT_S
    while len(killed) < times and time.monotonic() < deadline_s:
        written_ns = recording.stat().st_mtime_ns if recording.exists() else 0
        for pid in cells_of_this_process() - killed.keys():
            if written_ns > max(killed.values(), default=0):
                os.kill(pid, signal.SIGKILL)
                killed[pid] = time.time_ns()
        time.sleep(0.01)


def cells_of_this_process() -> set[int]:
    found = set()
    for thread in Path("/proc/self/task").iterdir():
        for child in (thread / "children").read_text().split():
            with contextlib.suppress(OSError):
                if b"station.campaign.cell" in Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0"):
                    found.add(int(child))
    return found
