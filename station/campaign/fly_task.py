"""Flies one flight of a campaign in this process."""

import shutil
from pathlib import Path

from station.campaign.flight_task import FlightTask
from station.campaign.memory_recorder import MemoryRecorder
from station.campaign.row import CRASHED, Row, failed_row, flown_row
from station.director import FlightPlan
from station.flight_record import read_flight
from station.lockstep_flight import SERVICES, at_lockstep_rate, build_node, fly_lockstep
from station.metrics.summary import summarise


def fly_task(task: FlightTask) -> Row:
    """Fly and measure. An exception is a result, too: the flight crashed."""
    try:
        return _fly(task)
    except Exception as error:
        said = str(error).strip().splitlines()
        return failed_row(task, CRASHED, f"{type(error).__name__}: {said[0] if said else 'no message'}")


def rehearse(task: FlightTask) -> None:
    """Build what the flight needs without flying, so that settings which no service can work with show before the first flight."""
    for name in SERVICES:
        if name != "recorder":
            build_node(name, at_lockstep_rate(task.settings)).close()


def _fly(task: FlightTask) -> Row:
    plan = FlightPlan(task.start_ned_m, flight_timeout_s=task.flight_timeout_s)
    if task.record_in:
        shutil.rmtree(
            task.record_in, ignore_errors=True
        )  # what a process that was killed left there is no part of this flight
        recorder = task.settings.recorder.model_copy(update={"directory": Path(task.record_in)})
        outcome = fly_lockstep(task.settings.model_copy(update={"recorder": recorder}), plan)
        record = read_flight(Path(task.record_in) / recorder.file_name)
    else:
        memory = MemoryRecorder(task.settings)
        outcome = fly_lockstep(task.settings, plan, recorder=memory)
        record = memory.record()
    return flown_row(task, summarise(record, task.pad_radius_m), outcome.failure, outcome.flown_s)
