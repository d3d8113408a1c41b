"""The services that steer share the last of the processors they may use, if none of them can be made to wait there."""

import multiprocessing
import os
import threading
from pathlib import Path

import pytest

from alight.runtime.placement import TOGETHER, gather
from alight.runtime.priority import IN_THE_BACKGROUND, REAL_TIME, may_run_in_real_time, prioritise

pytestmark = pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="processes are not placed on this system")


def _placed(service: str, wanted: bool, real_time: bool, allowed: set[int]) -> tuple[str, list[set[int]]]:
    """What a fresh process with two threads says of itself, and where each of its threads may run."""
    os.sched_setaffinity(0, allowed)
    end = threading.Event()
    threading.Thread(target=end.wait).start()
    prioritise(service, real_time=real_time)
    said = gather(service, wanted=wanted)
    threads = [int(entry.name) for entry in Path("/proc/self/task").iterdir()]
    where = [os.sched_getaffinity(thread) for thread in threads]
    end.set()
    return said, where


def placed(
    service: str, *, wanted: bool = True, real_time: bool = True, allowed: set[int] | None = None
) -> tuple[str, list[set[int]]]:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(_placed, (service, wanted, real_time, allowed or os.sched_getaffinity(0)))


needs_real_time = pytest.mark.skipif(
    not (may_run_in_real_time() and len(os.sched_getaffinity(0)) > 1),
    reason="needs the right to real-time scheduling and a second processor",
)


@needs_real_time
def test_every_thread_of_one_that_steers_runs_on_the_last_processor() -> None:
    last = max(os.sched_getaffinity(0))
    said, threads = placed("filter")
    assert said == f"processor {last}"
    assert len(threads) >= 2 and all(processors == {last} for processors in threads)


@needs_real_time
@pytest.mark.parametrize("service", ["detector", "camera", "recorder"])
def test_what_works_on_pictures_may_run_anywhere(service: str) -> None:
    everywhere = os.sched_getaffinity(0)
    said, threads = placed(service)
    assert said == "any" and all(processors == everywhere for processors in threads)


@needs_real_time
def test_where_the_settings_forbid_it_nothing_is_placed() -> None:
    said, threads = placed("filter", wanted=False)
    assert said == "any" and all(processors == os.sched_getaffinity(0) for processors in threads)


def test_a_process_that_others_may_overtake_keeps_all_processors() -> None:
    said, threads = placed("filter", real_time=False)
    assert said == "any" and all(processors == os.sched_getaffinity(0) for processors in threads)


def test_one_that_may_use_a_single_processor_stays_there() -> None:
    first = min(os.sched_getaffinity(0))
    said, threads = placed("filter", allowed={first})
    assert said == "any" and all(processors == {first} for processors in threads)


def test_those_on_one_processor_never_stand_back() -> None:
    assert set(REAL_TIME) - TOGETHER == {"camera", "detector"}
    assert not TOGETHER & set(IN_THE_BACKGROUND)
