"""Campaigns and Dask clusters as processes of their own, to be killed from outside."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from station.campaign.ledger import FLIGHTS

_LOOK_PERIOD_S = 0.05
_CLUSTER_LIMIT_S = 60.0


class Group:
    """A process that leads a group of its own, with everything that it starts."""

    def __init__(self, words: Sequence[str], log: Path) -> None:
        with log.open("ab") as output:
            self.process = subprocess.Popen(
                [sys.executable, "-m", *words], stdout=output, stderr=subprocess.STDOUT, start_new_session=True
            )
        self.log = log

    @property
    def output(self) -> str:
        """What it said."""
        return self.log.read_text(encoding="utf-8", errors="replace")

    def kill(self) -> None:
        """End the whole group as the kernel would."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()


class CampaignProcess(Group):
    """`alight campaign SPEC --out OUT ...`."""

    def __init__(self, spec: Path, out: Path, options: Sequence[str] = ()) -> None:
        out.parent.mkdir(parents=True, exist_ok=True)
        words = ["station", "campaign", str(spec), "--out", str(out), *options]
        super().__init__(words, out.with_suffix(".log"))
        self._flights = out / FLIGHTS

    def flown(self) -> int:
        """How many flights it has written down."""
        return self._flights.read_bytes().count(b"\n") if self._flights.exists() else 0

    def wait_for_flights(self, count: int, limit_s: float) -> None:
        """Until so many are written down.

        Raises:
            RuntimeError: If it ends before, or takes longer.
        """
        deadline_s = time.monotonic() + limit_s
        while self.flown() < count:
            if self.process.poll() is not None or time.monotonic() > deadline_s:
                raise RuntimeError(f"{self.flown()} of {count} flights, and then:\n{self.output}")
            time.sleep(_LOOK_PERIOD_S)

    def finish(self, limit_s: float) -> None:
        """Until it ends well.

        Raises:
            RuntimeError: If it does not.
        """
        try:
            status = self.process.wait(limit_s)
        except subprocess.TimeoutExpired:
            status = None
        if status != 0:
            self.kill()
            raise RuntimeError(f"ended with status {status}:\n{self.output}")


class DaskCluster:
    """A scheduler and workers of one thread each on this machine's loopback, on free ports."""

    def __init__(self, folder: Path, workers: int) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._folder, self._file = folder, folder / "scheduler.json"
        self._scheduler = Group(
            ["distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard",
             "--scheduler-file", str(self._file)], folder / "scheduler.log"
        )  # fmt: skip
        self.workers: list[Group] = []
        self.address = self._await_address()
        for _ in range(workers):
            self.start_worker()

    def start_worker(self) -> None:
        """One more worker."""
        number = len(self.workers)
        local = str(self._folder / f"worker-{number}")
        self.workers.append(
            Group(
                ["distributed.cli.dask_worker", self.address, "--nthreads", "1", "--host", "127.0.0.1",
                 "--no-dashboard", "--local-directory", local], self._folder / f"worker-{number}.log"
            )
        )  # fmt: skip

    def close(self) -> None:
        """End everything."""
        for group in (*self.workers, self._scheduler):
            group.kill()

    def _await_address(self) -> str:
        deadline_s = time.monotonic() + _CLUSTER_LIMIT_S
        while time.monotonic() < deadline_s:
            with contextlib.suppress(OSError, ValueError):
                return str(json.loads(self._file.read_text(encoding="utf-8"))["address"])
            time.sleep(_LOOK_PERIOD_S)
        self._scheduler.kill()
        raise RuntimeError(f"no scheduler:\n{self._scheduler.output}")


@contextlib.contextmanager
def dask_cluster(folder: Path, workers: int = 2) -> Iterator[DaskCluster]:
    """A cluster that is ended in any case."""
    cluster = DaskCluster(folder, workers)
    try:
        yield cluster
    finally:
        cluster.close()
