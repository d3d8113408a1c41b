"""A live flight, as a stranger flies it: every service a process of its own."""

from pathlib import Path

import pytest
from flight_process import IN_THE_AIR, flight

from schemas import topics
from schemas.topics import SERVICES
from station.flight_record import read_flight
from station.metrics.summary import summarise

pytestmark = pytest.mark.system


def test_a_live_flight_lands_on_the_pad_and_leaves_recording_and_report(tmp_path: Path) -> None:
    with flight(tmp_path / "flight") as running:
        assert running.wait() == 0, running.output
    record = read_flight(tmp_path / "flight" / "flight.mcap")
    summary = summarise(record)
    assert summary.verdict.ok
    assert summary.verdict.by_truth and summary.verdict.error_m is not None
    assert summary.verdict.error_m <= 0.10
    assert {health.service for health in record.messages(topics.HEALTH)} >= SERVICES
    assert not record.provenance.defects
    report = (tmp_path / "flight" / "report.html").read_text()
    assert "<svg" in report and "data:image/jpeg;base64," in report


def test_ctrl_c_stops_everything_in_order(tmp_path: Path) -> None:
    with flight(tmp_path / "flight", IN_THE_AIR) as running:
        running.wait_for_line(lambda line: "descend" in line)
        pids = [running.pid_of(service) for service in sorted(SERVICES)]
        running.process.send_signal(2)
        assert running.wait(60.0) == 1
    assert "stopped by the operator" in running.output
    assert not [pid for pid in pids if Path(f"/proc/{pid}").exists()]
    assert not read_flight(tmp_path / "flight" / "flight.mcap").provenance.defects
