"""Real PX4 flights, recorded, played against the link: what comes out is what the log contains."""

import os
from collections import Counter
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from px4_log import AUTOPILOT, LOGS, Frame, frames, needs_logs

os.environ["MAVLINK20"] = "1"
from pymavlink import mavutil

from schemas.settings.commander import CommanderSettings
from schemas.vehicle import FlightMode, LandedState, VehicleState, VehicleStatus
from services.commander.command_queue import Command
from services.commander.link import AutopilotLink

TELL_STATUS = {0, 245, 436}
LANDED = {1: LandedState.ON_GROUND, 2: LandedState.IN_AIR, 3: LandedState.TAKING_OFF, 4: LandedState.LANDING}
MODES = {
    0x02040000: FlightMode.TAKEOFF,
    0x03040000: FlightMode.HOLD,
    0x04040000: FlightMode.MISSION,
    0x05040000: FlightMode.RETURN,
    0x06040000: FlightMode.LAND,
    0x09040000: FlightMode.PRECISION_LAND,
    0x00060000: FlightMode.OFFBOARD,
    0x00030000: FlightMode.POSITION,
}


@cache
def decoded(log: Path) -> SimpleNamespace:
    """The log through pymavlink's own reader, by another road than the link's."""
    reader = mavutil.mavlink_connection(str(log), dialect="development")
    found = SimpleNamespace(positions=[], attitudes=[], modes=[], landed=[], armed=[], acks=Counter(), commands=[])
    while (message := reader.recv_msg()) is not None:
        kind = message.get_type()
        if kind == "COMMAND_LONG" and message.get_srcSystem() == 245:
            found.commands.append(message)
        if (message.get_srcSystem(), message.get_srcComponent()) != AUTOPILOT:
            continue
        if kind == "GLOBAL_POSITION_INT":
            found.positions.append(message)
        elif kind == "ATTITUDE_QUATERNION":
            found.attitudes.append(message)
        elif kind in ("HEARTBEAT", "CURRENT_MODE"):
            found.modes.append(MODES[message.custom_mode])
            if kind == "HEARTBEAT":
                found.armed.append(bool(message.base_mode & 128))
        elif kind == "EXTENDED_SYS_STATE":
            found.landed.append(LANDED[message.landed_state])
        elif kind == "COMMAND_ACK" and message.target_system == 245:
            found.acks[message.command, message.result] += 1
    return found


def turn_rad(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Angles between rotations given as quaternions of either sign, (n, 4)."""
    nearer = other * np.sign(np.sum(one * other, axis=1))[:, None]
    return 4.0 * np.arcsin(np.linalg.norm(one - nearer, axis=1) / 2.0)


def numbers_of(state: VehicleState) -> tuple[int, ...]:
    place = state.position
    velocity = (round(part * 100) for part in state.velocity_ned_mps)
    return (
        round(place.latitude_deg * 1e7),
        round(place.longitude_deg * 1e7),
        round(place.altitude_amsl_m * 1e3),
        *velocity,
    )


def numbers_in(message: Any) -> tuple[int, ...]:
    return (message.lat, message.lon, message.alt, message.vx, message.vy, message.vz)


def without_repeats(values: list) -> list:
    return [value for i, value in enumerate(values) if i == 0 or value != values[i - 1]]


@cache
def played(log: Path) -> SimpleNamespace:
    """The autopilot's side of the log into a link, frame by frame; each command of the log is submitted at its time."""
    link = AutopilotLink(CommanderSettings())
    out = SimpleNamespace(states=[], modes=[], landed=[], armed=[], results=Counter())
    for frame in frames(log):
        if frame.source == AUTOPILOT:
            link.receive(frame.data, frame.at_ns)
            out.states += link.take_states()
            if frame.message_id in TELL_STATUS:
                note_status(link.status(frame.at_ns), out)
        elif (command := command_in(frame)) is not None:
            link.command(command, frame.at_ns)
        out.results.update((outcome.command.id, outcome.result) for outcome in link.take_outcomes())
    return out


def note_status(status: VehicleStatus, out: SimpleNamespace) -> None:
    if status.mode is not FlightMode.UNKNOWN:
        out.modes.append(status.mode)
        out.armed.append(status.armed)
    if status.landed_state is not LandedState.UNDEFINED:
        out.landed.append(status.landed_state)


def command_in(frame: Frame) -> Command | None:
    if frame.message_id not in (75, 76):
        return None
    payload = frame.data[10:-2].ljust(35, b"\0")
    return Command("from the log", int.from_bytes(payload[28:30], "little"))


@needs_logs
@pytest.mark.parametrize("log", LOGS, ids=lambda log: log.stem)
def test_the_link_says_what_the_log_contains(log: Path) -> None:
    known, out = decoded(log), played(log)

    assert len(out.states) > 0.98 * len(known.positions)
    positions = iter(known.positions)
    # The states come in the log's order; a position without attitudes around it may be left out.
    pairs = [
        (state, next(message for message in positions if numbers_of(state) == numbers_in(message)))
        for state in out.states
    ]
    lateness_s = np.array([message._timestamp - state.at_ns / 1e9 for state, message in pairs])
    # A log holds no answers to our TIMESYNC, so a stamp is bounded by arrival alone, and the simulations paused now and then.
    assert lateness_s.min() >= -1e-6
    assert np.median(lateness_s) < 0.05

    # Between the attitudes on both sides: the turns to each add up to the turn between them.
    boots = np.array([message.time_boot_ms for message in known.attitudes])
    quaternions = np.array([(m.q1, m.q2, m.q3, m.q4) for m in known.attitudes])
    at = np.array([message.time_boot_ms for _, message in pairs])
    after = np.searchsorted(boots, at)
    before = np.where(boots[after] == at, after, after - 1)
    middle = np.array([state.q_ned_body for state in out.states])
    turns = turn_rad(quaternions[before], middle) + turn_rad(middle, quaternions[after])
    assert turns == pytest.approx(turn_rad(quaternions[before], quaternions[after]), abs=2e-5)

    assert without_repeats(out.modes) == without_repeats(known.modes)
    assert without_repeats(out.landed) == without_repeats(known.landed)
    assert without_repeats(out.armed) == without_repeats(known.armed)


@needs_logs
@pytest.mark.parametrize("log", LOGS, ids=lambda log: log.stem)
def test_acknowledgements_find_their_commands(log: Path) -> None:
    known, out = decoded(log), played(log)
    names = ("accepted", "temporarily_rejected", "denied", "unsupported", "failed", "in_progress", "cancelled")
    in_log = Counter({(command, names[result]): count for (command, result), count in known.acks.items()})
    assert sum(in_log.values()) > 0
    assert out.results == in_log
