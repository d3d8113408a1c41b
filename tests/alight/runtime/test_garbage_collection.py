"""Garbage is looked for once a second, and not by Python itself."""

import gc
import weakref
from collections.abc import Iterator

import pytest

from alight.runtime.garbage_collection import LONGEST_NS, PERIOD_NS, GarbageCollection


class Ring:
    """Refers to itself, so that it does not go when nobody refers to it any more."""

    def __init__(self) -> None:
        self.me = self


def lost_ring() -> weakref.ref[Ring]:
    return weakref.ref(Ring())


@pytest.fixture(autouse=True)
def as_before() -> Iterator[None]:
    yield
    gc.enable()
    gc.unfreeze()


def test_a_ring_is_found_at_the_next_collection_and_not_before() -> None:
    collection = GarbageCollection()
    collection.begin()
    collection.collect(now_ns=10 * PERIOD_NS, quiet=True)
    ring = lost_ring()
    allocated = [[] for _ in range(100_000)]  # type: ignore[var-annotated] # Python by itself would have looked meanwhile
    collection.collect(now_ns=11 * PERIOD_NS - 1, quiet=True)
    assert ring() is not None and len(allocated) == 100_000
    collection.collect(now_ns=11 * PERIOD_NS, quiet=True)
    assert ring() is None


def test_a_node_that_is_never_quiet_collects_at_last() -> None:
    collection = GarbageCollection()
    collection.begin()
    collection.collect(now_ns=LONGEST_NS, quiet=True)
    ring = lost_ring()
    collection.collect(now_ns=2 * LONGEST_NS - 1, quiet=False)
    assert ring() is not None
    collection.collect(now_ns=2 * LONGEST_NS, quiet=False)
    assert ring() is None


def test_a_clock_that_is_set_back_delays_nothing() -> None:
    collection = GarbageCollection()
    collection.begin()
    collection.collect(now_ns=1_000_000 * PERIOD_NS, quiet=True)
    ring = lost_ring()
    collection.collect(now_ns=10 * PERIOD_NS, quiet=True)
    assert ring() is None


def test_a_process_that_leaves_it_to_python_is_left_alone() -> None:
    gc.collect()
    ring = lost_ring()
    GarbageCollection().collect(now_ns=10 * PERIOD_NS, quiet=True)
    assert ring() is not None
