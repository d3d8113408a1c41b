"""A landing with a detector that shares no code with ours: examples/foreign_detector, on Zenoh and the exported schemas alone."""

import ast
import contextlib
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from flight_process import IN_THE_AIR, REPOSITORY, flight

from schemas import topics
from station.flight_record import read_flight
from station.metrics.summary import summarise

pytestmark = pytest.mark.system

EXAMPLE = REPOSITORY / "examples" / "foreign_detector"
ITS_LIBRARIES = {"zenoh", "cv2", "numpy", "jsonschema"}


@contextlib.contextmanager
def foreign_detector(directory: Path, bus_port: int) -> Iterator[Path]:
    """The example as a process in a folder of its own; gives the file with what it says."""
    export = [sys.executable, "-m", "station", "schema", "export", str(directory / "contract")]
    subprocess.run(export, cwd=REPOSITORY, check=True, capture_output=True)
    log = directory / "foreign.log"
    with log.open("wb") as sink:
        command = [sys.executable, str(EXAMPLE / "detector.py"), "contract", "--connect", f"tcp/127.0.0.1:{bus_port}"]
        process = subprocess.Popen(command, cwd=directory, stdout=sink, stderr=subprocess.STDOUT)
        try:
            yield log
        finally:
            process.send_signal(signal.SIGTERM)
            assert process.wait(20.0) == 0, log.read_text()


def test_the_example_imports_nothing_of_ours() -> None:
    own = {path.stem for path in EXAMPLE.glob("*.py")}
    imported = set()
    for path in EXAMPLE.glob("*.py"):
        for statement in ast.walk(ast.parse(path.read_text())):
            if isinstance(statement, ast.Import):
                imported |= {alias.name for alias in statement.names}
            elif isinstance(statement, ast.ImportFrom):
                imported.add(statement.module or ".")
    roots = {name.split(".")[0] for name in imported}
    assert roots - own - sys.stdlib_module_names == ITS_LIBRARIES


def test_a_flight_lands_on_the_pad_with_a_detector_from_elsewhere(tmp_path: Path) -> None:
    out = tmp_path / "flight"
    with (
        flight(out, ("--without", "detector", *IN_THE_AIR)) as running,
        foreign_detector(tmp_path, running.bus_port) as log,
    ):
        status = running.wait()
    said = running.output + log.read_text()
    assert status == 0, said
    record = read_flight(out / "flight.mcap")
    verdict = summarise(record).verdict
    assert verdict.ok and verdict.error_m is not None and verdict.error_m <= 0.10, said
    detections = record.messages(topics.DETECTION)
    assert {detection.detector for detection in detections} == {"foreign"}
    assert all([hop.service for hop in detection.hops] == ["camera", "detector"] for detection in detections)
    assert any(detection.markers for detection in detections) and not any(detection.pad for detection in detections)
    _nothing_was_refused(record)


def _nothing_was_refused(record) -> None:
    last = {health.service: health for health in record.messages(topics.HEALTH)}
    of_detections = next(entry for entry in last["geolocator"].inputs if entry.topic == topics.DETECTION.name)
    assert of_detections.received > 0 and not any(of_detections.refused.values())
    assert last["detector"].counters["frames_with_markers"] > 0 and last["detector"].counters["unusable"] == 0
