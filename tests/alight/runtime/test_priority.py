"""Services ask for the priority that the landing needs, and fly without it where they may not have it."""

import contextlib
import multiprocessing
import os
import subprocess
import sys

import pytest

from alight.runtime.priority import IN_THE_BACKGROUND, REAL_TIME, hasten, may_run_in_real_time, prioritise
from schemas.topics import MISSION_SERVICES


def _give_up_rights_unless(allowed: bool) -> None:
    if not allowed and os.geteuid() == 0:
        with contextlib.suppress(PermissionError):  # a root so restricted has no right to real time either
            os.setgid(65534)
            os.setuid(65534)


def _outcome(service: str, real_time: bool, allowed: bool) -> tuple[str, int, int]:
    """What a fresh process says of itself, its scheduling policy and its niceness."""
    _give_up_rights_unless(allowed)
    return prioritise(service, real_time=real_time), os.sched_getscheduler(0), os.nice(0)


def _asked(allowed: bool) -> tuple[bool, int]:
    """Whether a fresh process may run in real time, and its scheduling policy after it has asked."""
    _give_up_rights_unless(allowed)
    return may_run_in_real_time(), os.sched_getscheduler(0)


def outcome(service: str, real_time: bool = True, allowed: bool = True) -> tuple[str, int, int]:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(_outcome, (service, real_time, allowed))


def may_be_real_time() -> bool:
    return outcome("commander")[1] == os.SCHED_FIFO


@pytest.mark.skipif(not hasattr(os, "sched_setscheduler"), reason="no real-time scheduling on this system")
class TestOnLinux:
    def test_without_the_right_to_it_a_service_runs_as_any_other(self) -> None:
        said, policy, _ = outcome("commander", allowed=False)
        assert (said, policy) == ("normal", os.SCHED_OTHER)

    def test_it_is_not_asked_for_where_the_settings_forbid_it(self) -> None:
        said, policy, _ = outcome("commander", real_time=False)
        assert (said, policy) == ("normal", os.SCHED_OTHER)

    def test_with_the_right_to_it_the_commander_is_real_time(self) -> None:
        if not may_be_real_time():
            pytest.skip("this user may not have real-time scheduling")
        assert outcome("commander")[0] == f"real-time {REAL_TIME['commander']}"

    def test_a_process_that_loads_can_be_hastened_from_outside(self) -> None:
        if not may_be_real_time():
            pytest.skip("this user may not have real-time scheduling")
        child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
        hasten(child.pid, "commander")
        policy = os.sched_getscheduler(child.pid)
        child.communicate(b"\n")
        assert policy == os.SCHED_FIFO
        hasten(child.pid, "commander")  # gone: nothing happens

    @pytest.mark.parametrize("allowed", [False, True])
    def test_whoever_asks_for_the_right_to_it_stays_as_it_is(self, allowed: bool) -> None:
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            may, policy = pool.apply(_asked, (allowed,))
        assert policy == os.SCHED_OTHER
        assert may is (allowed and may_be_real_time())

    def test_the_recorder_stands_back(self) -> None:
        said, policy, niceness = outcome("recorder")
        wanted = min(19, os.nice(0) + IN_THE_BACKGROUND["recorder"])
        assert (said, policy, niceness) == (f"nice {wanted}", os.SCHED_OTHER, wanted)


def test_what_is_nearer_to_the_vehicle_goes_first() -> None:
    order = ("camera", "detector", "geolocator", "filter", "commander")
    assert set(order) == MISSION_SERVICES
    priorities = [REAL_TIME[service] for service in order]
    assert priorities == sorted(set(priorities))
    assert not set(REAL_TIME) & set(IN_THE_BACKGROUND)
