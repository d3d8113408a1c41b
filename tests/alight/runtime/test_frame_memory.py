"""Frames travel in shared memory where there is room, and as bytes where there is none: they always travel."""

import contextlib
import multiprocessing
import os
import resource

import pytest

from alight.runtime import frame_memory
from alight.runtime.frame_memory import MOST_FRAMES, FrameMemory

VGA = 640 * 480
LITTLE = 8 * 2**20


def picture(number: int, size: int = VGA) -> bytes:
    return bytes([number]) * size


def in_shared_memory(held: object) -> bool:
    return not isinstance(held, bytes)


def test_what_is_held_is_the_picture() -> None:
    memory = FrameMemory(wanted=True)
    for number, size in ((1, VGA), (2, VGA), (3, 2 * VGA), (4, VGA)):
        held = memory.held(picture(number, size))
        assert in_shared_memory(held)
        assert bytes(held) == picture(number, size)


def test_readers_that_let_go_of_nothing_cost_the_shared_memory_and_no_picture() -> None:
    memory = FrameMemory(wanted=True)
    kept = [memory.held(picture(number)) for number in range(MOST_FRAMES + 5)]
    assert [bytes(held) for held in kept] == [picture(number) for number in range(MOST_FRAMES + 5)]
    assert in_shared_memory(kept[0]) and not in_shared_memory(kept[-1])
    kept.clear()
    assert in_shared_memory(memory.held(picture(99)))


def _room_where_little_may_be_locked() -> list[bool]:
    """Which sizes of pictures a process finds shared memory for that may lock little of it."""
    resource.setrlimit(resource.RLIMIT_MEMLOCK, (LITTLE, LITTLE))
    with contextlib.suppress(PermissionError):  # whoever may change users may lock as much as he likes
        os.setgid(65534)
        os.setuid(65534)
    return [in_shared_memory(FrameMemory(wanted=True).held(picture(1, size))) for size in (3 * VGA, 9 * VGA)]


def test_where_little_memory_may_be_locked_fewer_frames_find_room() -> None:
    if 0 <= resource.getrlimit(resource.RLIMIT_MEMLOCK)[1] < LITTLE:
        pytest.skip("this user may lock even less")
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(_room_where_little_may_be_locked) == [True, False]


@pytest.mark.parametrize(("wanted", "size"), [(False, VGA), (True, 100), (True, 40 * 2**20)])
def test_what_is_not_wanted_there_or_too_small_or_too_large_stays_as_it_is(wanted: bool, size: int) -> None:
    assert FrameMemory(wanted=wanted).held(picture(7, size)) == picture(7, size)


def test_no_more_is_taken_than_the_host_has(monkeypatch: pytest.MonkeyPatch) -> None:
    """Memory that the host promises and does not have ends the process that writes to it."""
    real = os.statvfs("/")
    full = os.statvfs_result((4096, 4096, 100, 10, 10, *tuple(real)[5:]))
    monkeypatch.setattr(frame_memory.os, "statvfs", lambda _: full)
    assert not in_shared_memory(FrameMemory(wanted=True).held(picture(7)))
