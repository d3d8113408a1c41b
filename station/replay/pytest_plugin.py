"""Recordings as tests: each has to yield, through the nodes of today, what it holds.

A folder becomes one of replay tests by a `conftest.py` with one line:

    from station.replay.pytest_plugin import pytest_collect_file, replay_flight  # noqa: F401

Every `*.mcap` file in it is then a test. For tests of one's own the fixture `replay_flight` replays a file.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from station.replay.recording import ReplayRecording
from station.replay.replay import replay
from station.replay.result import ReplayResult
from station.replay.text import result_lines
from station.replay.tolerance import ROUNDING
from station.replay.update import journalled

ReplayFlight = Callable[..., ReplayResult]


class FlightDiffersError(Exception):
    """A replay that does not yield what the recording holds."""


class FlightFile(pytest.File):
    """One recording."""

    def collect(self) -> Iterator[pytest.Item]:
        """One test: its replay through all nodes whose journals it holds."""
        yield FlightItem.from_parent(self, name="replay")


class FlightItem(pytest.Item):
    """The replay of one recording."""

    def runtest(self) -> None:
        """Replay and compare."""
        result = _replay(self.path)
        if not result.equal:
            raise FlightDiffersError("\n".join(result_lines(result)))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], *args: Any) -> Any:  # noqa: ARG002
        """What differs, and what to do if that is meant."""
        if isinstance(excinfo.value, FlightDiffersError):
            return f"{excinfo.value}\nif that is meant: alight replay {self.path} --update"
        return super().repr_failure(excinfo)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """The file, for the report."""
        return self.path, None, f"replay of {self.path.name}"


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> FlightFile | None:
    """Take recordings as tests."""
    if file_path.suffix != ".mcap":
        return None
    file: FlightFile = FlightFile.from_parent(parent, path=file_path)
    return file


@pytest.fixture
def replay_flight() -> ReplayFlight:
    """Replays a recording: `replay_flight(path, through=("filter",), assignments=("filter.method=median",))`."""
    return _replay


def _replay(path: Path, through: Sequence[str] = (), assignments: Sequence[str] = ()) -> ReplayResult:
    recording = ReplayRecording(path)
    return replay(recording, through or journalled(recording), assignments, ROUNDING)
