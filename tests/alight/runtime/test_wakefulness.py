"""Processors are kept awake for as long as somebody flies, by what gives way to everything else."""

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from alight.runtime import idle_loop, wakefulness
from alight.runtime.wakefulness import has_quota, kept_awake

pytestmark = pytest.mark.skipif(not hasattr(os, "SCHED_IDLE"), reason="no such scheduling on this system")


def loops_of(parent: int) -> list[int]:
    """Process ids of the loops that a process has started."""
    children = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    return [int(pid) for pid in children if is_loop(int(pid))]


def is_loop(pid: int) -> bool:
    return b"alight.runtime.idle_loop" in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")


def becomes_true(condition: Callable[[], bool], patience_s: float = 60.0) -> bool:
    deadline_s = time.monotonic() + patience_s
    while not condition() and time.monotonic() < deadline_s:
        time.sleep(0.02)
    return condition()


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def test_nothing_is_kept_awake_that_need_not_be() -> None:
    with kept_awake(wanted=False, real_time=True) as how:
        assert how.startswith("no") and loops_of(os.getpid()) == []


def test_a_host_is_kept_awake_or_says_why_not_and_nothing_stays_behind() -> None:
    with kept_awake(wanted=True, real_time=True) as how:
        assert how.startswith(("by ", "no: "))
        wanted = int(how.split()[1]) if how.startswith("by ") and how.endswith("loops") else 0
        assert becomes_true(lambda: len(loops_of(os.getpid())) == wanted)
        loops = loops_of(os.getpid())
        for pid in loops:
            assert becomes_true(lambda pid=pid: os.sched_getscheduler(pid) == os.SCHED_IDLE)  # type: ignore[misc]
            assert becomes_true(lambda pid=pid: len(os.sched_getaffinity(pid)) == 1)  # type: ignore[misc]
    assert not any(is_alive(pid) for pid in loops)


@pytest.mark.parametrize(("driver", "latency_us"), [("intel_idle", 10), ("haltpoll", 0)])
def test_the_kernel_is_asked_for_a_sleep_that_does_not_give_the_processor_away(
    driver: str, latency_us: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = tmp_path / "latency"
    (tmp_path / "driver").write_text(f"{driver}\n")
    monkeypatch.setattr(wakefulness, "_SLEEP_DRIVER", tmp_path / "driver")
    monkeypatch.setattr(wakefulness, "_LATENCY_DEVICE", device)
    with kept_awake(wanted=True, real_time=True) as how:
        assert how == "by the kernel" and loops_of(os.getpid()) == []
    assert int.from_bytes(device.read_bytes(), sys.byteorder) == latency_us


@pytest.fixture
def sleepless(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A host whose kernel knows of no sleep states, and which has as many processors and as much time as loops need."""
    monkeypatch.setattr(wakefulness, "_SLEEP_DRIVER", tmp_path / "none")
    monkeypatch.setattr(wakefulness, "_CGROUPS", tmp_path)
    monkeypatch.setattr(wakefulness, "MOST_LOOPS", 10_000)


@pytest.mark.usefixtures("sleepless")
def test_a_host_that_has_no_process_left_does_not_end_the_flight(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none_left(*_: object, **__: object) -> None:
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(wakefulness, "AUTOGROUP", tmp_path / "none")
    monkeypatch.setattr(wakefulness, "may_run_in_real_time", lambda: True)
    monkeypatch.setattr(wakefulness.subprocess, "Popen", none_left)
    with kept_awake(wanted=True, real_time=True) as how:
        assert how.startswith("no: Resource temporarily unavailable")


LOOP = [sys.executable, "-m", "alight.runtime.idle_loop", str(min(os.sched_getaffinity(0)))]


def may_weigh_nothing() -> bool:
    """Whether this host lets a loop make itself light: one whose parent is gone already tries, and ends."""
    return subprocess.run([*LOOP, "0"], start_new_session=True, check=False).returncode == 0


def test_a_loop_ends_with_its_parent_however_that_ends() -> None:
    if not may_weigh_nothing():
        pytest.skip("no loop may run on this host: it could not give way to everything else")
    code = (
        "import os, subprocess, sys\n"
        f"loop = subprocess.Popen([*{LOOP}, str(os.getpid())])\n"
        "print(loop.pid, flush=True)\n"
        "sys.stdin.read()\n"
    )
    # A loop makes its whole session light, which must not be that of whoever runs the tests.
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", code], stdin=pipe, stdout=pipe, start_new_session=True) as parent:
        assert parent.stdout is not None
        loop = int(parent.stdout.readline())
        try:
            assert becomes_true(lambda: os.sched_getscheduler(loop) == os.SCHED_IDLE)
            assert is_alive(loop)
        finally:
            parent.kill()
    assert becomes_true(lambda: not is_alive(loop))


def test_a_loop_in_a_session_that_is_not_weighed_is_light_already(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "autogroup").touch()  # so the kernel says it to what the first process has started without a session
    monkeypatch.setattr(idle_loop, "AUTOGROUP", tmp_path / "autogroup")
    before = os.sched_getaffinity(0)
    monkeypatch.setattr(idle_loop.os, "sched_setscheduler", lambda *_: None)
    assert idle_loop.main(min(before), parent=0) == 0
    os.sched_setaffinity(0, before)
    assert (tmp_path / "autogroup").read_text() == ""


def test_a_loop_that_cannot_make_itself_light_ends_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(idle_loop, "AUTOGROUP", tmp_path)  # a folder: nothing can be written to it
    before = os.sched_getaffinity(0)
    monkeypatch.setattr(idle_loop.os, "sched_setscheduler", lambda *_: None)
    assert idle_loop.main(min(before), os.getppid()) == 1
    os.sched_setaffinity(0, before)


@pytest.mark.usefixtures("sleepless")
@pytest.mark.parametrize(
    ("asked_for", "allowed", "reason"),
    [(True, False, "real-time"), (False, True, "real-time"), (True, True, "share of the time")],
)
def test_no_loop_is_started_that_would_be_in_the_way(
    asked_for: bool, allowed: bool, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wakefulness, "AUTOGROUP", tmp_path)
    monkeypatch.setattr(wakefulness.os, "access", lambda *_: False)  # root may write to anything
    monkeypatch.setattr(wakefulness, "may_run_in_real_time", lambda: allowed)
    with kept_awake(wanted=True, real_time=asked_for) as how:
        assert how.startswith("no: ") and reason in how and loops_of(os.getpid()) == []


@pytest.mark.parametrize(
    ("file", "text", "limited"),
    [
        ("cpu.max", "max 100000", False),
        ("cpu.max", "200000 100000", True),
        ("cpu/cpu.cfs_quota_us", "-1", False),
        ("cpu/cpu.cfs_quota_us", "150000", True),
    ],
)
def test_where_a_container_may_use_only_so_much_time_no_loop_may_use_it_up(
    tmp_path: Path, file: str, text: str, limited: bool
) -> None:
    (tmp_path / file).parent.mkdir(exist_ok=True)
    (tmp_path / file).write_text(f"{text}\n")
    assert has_quota(tmp_path) is limited


def test_a_host_without_limits_has_none(tmp_path: Path) -> None:
    assert not has_quota(tmp_path)
