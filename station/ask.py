"""`alight land|hold|abort|status`: ask the commander, or look, from any machine on the bus."""

import argparse
import logging
import os
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path

from alight.runtime.bus import Bus, BusError
from alight.runtime.clock import nanoseconds
from alight.runtime.live import LiveRunner
from alight.runtime.node import Arrival, Node, Output, Publication
from alight.runtime.settings_file import SettingsError, load_settings
from schemas import topics
from schemas.health import Health
from schemas.mission import MissionReply, MissionRequest, MissionStatus, Verb
from schemas.settings import Settings
from schemas.vehicle import VehicleStatus
from station.clock_lines import clock_lines

REPLY_TIMEOUT_S = 5.0
LOOK_S = 2.5


class Asker(Node):
    """Asks once, repeating until answered; listens to the status meanwhile."""

    service = "station"
    tick_period_ns = nanoseconds(0.5)

    def __init__(self, verb: Verb | None, reason: str) -> None:
        super().__init__()
        self.reply: MissionReply | None = None
        self.mission: MissionStatus | None = None
        self.vehicle: VehicleStatus | None = None
        self.health: dict[str, Health] = {}
        self.alive: set[str] = set()
        """Services whose liveliness token is on the bus."""
        self._verb = verb
        self._reason = reason
        self._request_id = f"asked-{uuid.uuid4().hex}"
        self.subscribe(topics.REPLY, self._on_reply)
        self.subscribe(topics.MISSION_STATUS, self._on_mission)
        self.subscribe(topics.VEHICLE_STATUS, self._on_vehicle)
        self.subscribe(topics.HEALTH, self._on_health)

    def on_tick(self, now_ns: int) -> Iterator[Output]:
        """Ask, and ask again with the same id until there is a reply."""
        if self._verb is not None and self.reply is None:
            yield Publication(
                topics.REQUEST,
                MissionRequest(at_ns=now_ns, request_id=self._request_id, verb=self._verb, reason=self._reason),
            )

    def _on_reply(self, arrival: Arrival[MissionReply]) -> Iterator[Output]:
        if arrival.message.request_id == self._request_id:
            self.reply = arrival.message
        return iter(())

    def _on_mission(self, arrival: Arrival[MissionStatus]) -> Iterator[Output]:
        self.mission = arrival.message
        return iter(())

    def _on_vehicle(self, arrival: Arrival[VehicleStatus]) -> Iterator[Output]:
        self.vehicle = arrival.message
        return iter(())

    def _on_health(self, arrival: Arrival[Health]) -> Iterator[Output]:
        if arrival.message.service != self.service:
            self.health[arrival.message.service] = arrival.message
        return iter(())


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of all four commands."""
    parser.add_argument(
        "--settings", type=Path, metavar="FILE", help="TOML file with settings: vehicle and bus matter here"
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="SECTION.KEY=VALUE", help="set one key; repeatable"
    )
    parser.add_argument("--reason", default="asked from the command line", help="why, for the log")


def run_verb(verb: Verb, arguments: argparse.Namespace) -> int:
    """Ask; exit status 0 if the commander accepted."""
    try:
        asker = _join(verb, arguments, REPLY_TIMEOUT_S, lambda node: node.reply is not None)
    except (SettingsError, BusError) as error:
        sys.stderr.write(f"alight {verb}: {error}\n")
        return 2
    if asker.reply is None:
        sys.stderr.write(f"alight {verb}: no commander answered within {REPLY_TIMEOUT_S:.0f} s: is one on this bus?\n")
        return 1
    print(f"{'accepted' if asker.reply.accepted else 'refused'}: {asker.reply.reason}")
    return 0 if asker.reply.accepted else 1


def run_status(arguments: argparse.Namespace) -> int:
    """Look for a moment and print what is there; exit status 1 if nothing is."""
    try:
        asker = _join(None, arguments, LOOK_S, lambda _: False)
    except (SettingsError, BusError) as error:
        sys.stderr.write(f"alight status: {error}\n")
        return 2
    if not asker.alive and not asker.health and asker.mission is None:
        sys.stderr.write("alight status: nothing of Alight is on this bus: check bus.connect and the vehicle's name\n")
        return 1
    for line in status_lines(asker):
        print(line)
    return 0


def status_lines(asker: Asker) -> Iterator[str]:
    """The status as a person reads it."""
    if asker.mission is not None:
        yield f"mission  {asker.mission.phase}: {asker.mission.reason}"
    if asker.vehicle is not None:
        vehicle = asker.vehicle
        words = "armed" if vehicle.armed else "disarmed"
        link = "connected" if vehicle.connected else "NOT CONNECTED"
        yield f"vehicle  {link}, {words}, {vehicle.mode}, {vehicle.landed_state}{', FAILSAFE' if vehicle.failsafe else ''}"
    for service in sorted(asker.alive - set(asker.health)):
        yield f"{service:<11}is there, but has not said how it is"
    for service, health in sorted(asker.health.items()):
        rates = ", ".join(f"{entry.topic} {entry.rate_hz:.0f} Hz" for entry in health.outputs)
        yield f"{service:<11}{'; '.join(health.complaints) or 'well'}{f'  ({rates})' if rates else ''}"
    for line in clock_lines(asker.health.values()):
        yield f"{'clock':<11}{line}"


def _join(verb: Verb | None, arguments: argparse.Namespace, timeout_s: float, done: Callable[[Asker], bool]) -> Asker:
    logging.getLogger("alight").addHandler(logging.NullHandler())  # a look must not print what it refuses
    settings: Settings = load_settings(arguments.settings, os.environ, arguments.set)
    asker = Asker(verb, arguments.reason)
    runner = LiveRunner(asker, settings, ports={}, bus=Bus(settings.vehicle, settings.bus))
    runner.bus.watch_alive(lambda service, alive: _note(asker.alive, service, alive))
    thread = threading.Thread(target=runner.run, daemon=True)
    thread.start()
    deadline_s = time.monotonic() + timeout_s
    while time.monotonic() < deadline_s and not done(asker):
        time.sleep(0.02)
    runner.stop()
    thread.join(timeout=2.0)
    return asker


def _note(alive: set[str], service: str, present: bool) -> None:
    """Called for each token that appears or vanishes; the station's own is of no interest."""
    if service != Asker.service:
        alive.add(service) if present else alive.discard(service)
