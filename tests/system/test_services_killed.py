"""Each service killed during the descent: the vehicle holds or lands, the service comes back, the landing completes."""

from pathlib import Path

import pytest
from flight_process import IN_THE_AIR, flight

from schemas.topics import MISSION_SERVICES
from station.flight_record import read_flight
from station.metrics.incidents import IncidentKind
from station.metrics.summary import summarise

pytestmark = pytest.mark.system


@pytest.mark.parametrize("service", sorted(MISSION_SERVICES))
def test_a_landing_survives_the_death_of(service: str, tmp_path: Path) -> None:
    with flight(tmp_path / "flight", IN_THE_AIR) as running:
        running.wait_for_line(lambda line: "-> descend" in line)
        running.wait_for_line(lambda line: "descend  " in line)
        killed = running.pid_of(service)
        running.kill_service(service)
        running.wait_for_line(lambda line: f"!! {service} killed by signal 9" in line)
        status = running.wait()
    assert status == 0, running.output
    assert f"{service} killed by signal 9 and was started again" in running.output
    summary = summarise(read_flight(tmp_path / "flight" / "flight.mcap"))
    assert summary.verdict.ok
    restarts = [
        incident
        for incident in summary.incidents
        if incident.service == service and incident.kind is IncidentKind.RESTARTED
    ]
    assert restarts, f"the report does not say that {service} (pid {killed}) was restarted"
