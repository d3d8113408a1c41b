"""Flies on this machine's cores: one cell each, each one flight at a time."""

import os
import queue
import threading
import time
from collections.abc import Iterable, Iterator

from station.campaign.cell_process import CellError, CellProcess
from station.campaign.crew import CrewError, Flown
from station.campaign.flight_task import FlightTask


def cores() -> int:
    """How many this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class LocalCrew:
    """As many cells as `jobs`; see `station.campaign.crew.Crew`."""

    def __init__(self, jobs: int, time_limit_s: float) -> None:
        self._time_limit_s = time_limit_s
        self._cells = [CellProcess() for _ in range(jobs)]
        self._threads: list[threading.Thread] = []

    def fly(self, tasks: Iterable[FlightTask]) -> Iterator[Flown]:
        """See `Crew.fly`. Tasks are taken one at a time, when a cell is free."""
        waiting, taking = iter(tasks), threading.Lock()
        done: queue.SimpleQueue[Flown | CellError | None] = queue.SimpleQueue()

        def work(cell: CellProcess) -> None:
            try:
                while True:
                    with taking:
                        task = next(waiting, None)
                    if task is None:
                        break
                    done.put(self._one(cell, task))
                done.put(None)
            except CellError as error:
                done.put(error)

        self._threads = [threading.Thread(target=work, args=(cell,), daemon=True) for cell in self._cells]
        for thread in self._threads:
            thread.start()
        for _ in self._threads:
            while (flown := done.get()) is not None:
                if isinstance(flown, CellError):
                    raise CrewError(str(flown))
                yield flown

    def close(self) -> None:
        """End the cells, in the middle of a flight if need be."""
        for cell in self._cells:
            cell.stop()
        for thread in self._threads:
            thread.join()
        for cell in self._cells:
            cell.close()

    def _one(self, cell: CellProcess, task: FlightTask) -> Flown:
        began_s = time.perf_counter()
        row = cell.fly(task, self._time_limit_s)
        return Flown(row, time.perf_counter() - began_s, os.uname().nodename, cell.software)
