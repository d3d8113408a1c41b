"""Flies on a Dask cluster: the workers may come, go and die while the campaign goes on.

A worker flies in a cell beside it, as the local crew does, so a flight that crashes or hangs takes no worker along. Dask
gives what a dead worker left undone to another one; a result reaches this process once, since each flight has one future.
"""

import os
import queue
import threading
import time
from collections.abc import Iterable, Iterator
from typing import Any

from station.campaign.cell_process import CellProcess
from station.campaign.crew import CrewError, Flown
from station.campaign.flight_task import FlightTask
from station.campaign.software import software

_CONNECT_LIMIT_S = 5.0
_FIRST_WORKER_LIMIT_S = 30.0
_NO_WORKER_LIMIT_S = 120.0
_LOOK_PERIOD_S = 2.0
_TRIES = 3
"""How often a flight is asked for whose worker died again and again."""
_OF_THIS_THREAD = threading.local()


def fly_on_worker(task_json: str, time_limit_s: float) -> Flown:
    """Runs on a worker: one flight, in the cell of this thread."""
    cell: CellProcess | None = getattr(_OF_THIS_THREAD, "cell", None)
    if cell is None:
        cell = _OF_THIS_THREAD.cell = CellProcess()
    began_s = time.perf_counter()
    row = cell.fly(FlightTask.model_validate_json(task_json), time_limit_s)
    return Flown(row, time.perf_counter() - began_s, f"{os.uname().nodename}:{os.getpid()}", cell.software)


class DaskCrew:
    """The workers of one scheduler; see `station.campaign.crew.Crew`."""

    def __init__(self, address: str, time_limit_s: float) -> None:
        """Connect.

        Raises:
            CrewError: If there is no scheduler, no worker, or one of another software.
        """
        self._time_limit_s = time_limit_s
        self._held: set[Any] = set()
        self._client = _connected(address)
        try:
            _check_workers(self._client)
        except CrewError as error:
            self._client.close()
            raise CrewError(f"--cluster {address}: {error}") from None

    def fly(self, tasks: Iterable[FlightTask]) -> Iterator[Flown]:
        """See `Crew.fly`. As many flights are under way as keep the workers busy."""
        waiting, done = iter(tasks), queue.SimpleQueue[tuple[Any, FlightTask, int]]()
        under_way = 0
        while True:
            while under_way < self._window() and (task := next(waiting, None)) is not None:
                self._submit(task, 1, done)
                under_way += 1
            if under_way == 0:
                return
            future, task, tries = self._next_done(done)
            self._held.discard(future)
            if future.status == "finished":
                under_way -= 1
                yield future.result()
            elif tries < _TRIES:
                self._submit(task, tries + 1, done)
            else:
                raise CrewError(f"flight {task.index} could not be flown: {_why(future)}")

    def close(self) -> None:
        """Take back what is not flown, and leave the cluster as it was."""
        self._client.close()

    def _submit(self, task: FlightTask, tries: int, done: "queue.SimpleQueue[tuple[Any, FlightTask, int]]") -> None:
        future = self._client.submit(
            fly_on_worker, task.model_dump_json(), self._time_limit_s, pure=False, priority=-task.index
        )
        self._held.add(future)  # Dask forgets a task whose future nobody holds
        future.add_done_callback(lambda ended: done.put((ended, task, tries)))

    def _next_done(self, done: "queue.SimpleQueue[tuple[Any, FlightTask, int]]") -> tuple[Any, FlightTask, int]:
        alone_since_s = time.monotonic()
        while True:
            try:
                return done.get(timeout=_LOOK_PERIOD_S)
            except queue.Empty:
                if self._client.status != "running":
                    raise CrewError("the scheduler is gone; start it again, then this command") from None
                if self._threads():
                    alone_since_s = time.monotonic()
                elif time.monotonic() - alone_since_s > _NO_WORKER_LIMIT_S:
                    raise CrewError(
                        f"no worker for {_NO_WORKER_LIMIT_S:g} s; start one, then this command again"
                    ) from None

    def _window(self) -> int:
        return max(4, 3 * self._threads())

    def _threads(self) -> int:
        return sum(self._client.nthreads().values())


def _connected(address: str) -> Any:
    try:
        import distributed  # noqa: PLC0415 - an extra; needed here only
    except ImportError:
        raise CrewError("--cluster: Dask is not installed: pip install 'alight[campaign]'") from None
    connect: Any = distributed.Client
    try:
        return connect(address, timeout=_CONNECT_LIMIT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        reason = f"no scheduler answers there ({type(error).__name__}); start one: dask scheduler"
        raise CrewError(f"--cluster {address}: {reason}") from None


def _check_workers(client: Any) -> None:
    try:
        client.wait_for_workers(1, timeout=_FIRST_WORKER_LIMIT_S)
    except TimeoutError:
        raise CrewError("it has no workers; start one: dask worker ADDRESS") from None
    mine = software()
    for worker, theirs in client.run(software, on_error="return").items():
        if isinstance(theirs, BaseException):
            raise CrewError(f"{worker} has no Alight of this version ({theirs}); install it there")
        if theirs != mine:
            raise CrewError(f"{worker} has other software ({theirs}) than this machine ({mine}); install the same")


def _why(future: Any) -> str:
    error = future.exception() if future.status == "error" else future.status
    return f"{type(error).__name__}: {error}" if isinstance(error, BaseException) else str(error)
