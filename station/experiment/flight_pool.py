"""Processes that fly several lockstep flights at a time, and that outlive nobody who started them."""

import os
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context, parent_process


def flight_pool(jobs: int) -> ProcessPoolExecutor:
    """As many processes. One whose parent dies, however it dies, ends in the middle of its flight: its queue alone would keep it."""
    # A fresh interpreter each: a forked one would share OpenCV's threads, which do not survive a fork.
    return ProcessPoolExecutor(max(1, jobs), mp_context=get_context("spawn"), initializer=_end_with_parent)


def _end_with_parent() -> None:
    threading.Thread(target=_wait_for_parents_end, daemon=True).start()


def _wait_for_parents_end() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
