"""A flight with every service as its own process on Zenoh."""

import socket
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from alight.runtime.bus import Bus
from alight.runtime.live import LiveRunner
from alight.runtime.wakefulness import kept_awake
from schemas.settings import Settings
from schemas.settings.bus import BusSettings
from station.ctrl_c import CtrlC, ctrl_c_noted
from station.director import FlightDirector, FlightPlan
from station.progress import Progress
from station.supervisor import Incident, Supervisor

SETTLE_S = 1.0
"""Flown on after the end, so that the recording shows the vehicle at rest."""
POLL_S = 0.05
STARTING_S = 3.0
"""Until then the services start and find each other, and need what time there is; from then on the processors are kept awake."""
RECORDER_STARTS_S = 5.0
"""The other services wait so long for the recorder at most."""


@dataclass
class LiveOutcome:
    """How a live flight went."""

    failure: str | None = None
    """None after a landing."""
    incidents: list[Incident] = field(default_factory=list)
    """Services that died and were started again."""


def rendezvous(settings: BusSettings) -> BusSettings:
    """The station's side of the bus: it listens where the services look for it.

    Zenoh's gossip tells the services of each other there; their messages then go directly, not through the station. Of
    the endpoints in `bus.connect` the station takes those whose address is this host's own; it connects to the others
    (a router of the site, another station), as the services do.
    """
    if settings.mode == "client":
        return settings
    own = tuple(endpoint for endpoint in settings.connect if _is_own_address(endpoint))
    others = tuple(endpoint for endpoint in settings.connect if endpoint not in own)
    return settings.model_copy(update={"listen": own or settings.listen, "connect": others})


def _is_own_address(endpoint: str) -> bool:
    host = endpoint.split("/", 1)[-1].rsplit(":", 1)[0]
    try:
        with socket.create_server((host, 0)):
            return True
    except OSError:
        return False


def fly_live(
    settings: Settings, plan: FlightPlan, services: tuple[str, ...], settings_file: Path, log_directory: Path
) -> LiveOutcome:
    """Start the services, direct the flight, stop them all. Ctrl-C ends it in order.

    Raises:
        BusError: If the bus cannot be joined.
        ServiceError: If a service's settings or port are at fault.
    """
    director = FlightDirector(settings, plan)
    bus = Bus(settings.vehicle, rendezvous(settings.bus))
    runner = LiveRunner(director, settings, ports={}, bus=bus)
    thread = threading.Thread(target=runner.run, daemon=True)
    supervisor = Supervisor(settings_file, log_directory, settings.process.real_time)
    outcome = LiveOutcome(incidents=supervisor.incidents)
    with ctrl_c_noted() as asked, ExitStack() as awake:
        try:
            _start(supervisor, services, bus, asked)
            thread.start()
            keep = kept_awake(wanted=settings.process.awake != "never", real_time=settings.process.real_time)
            _follow(director, supervisor, asked, lambda: awake.enter_context(keep))
            outcome.failure = director.failure
            _settle(supervisor, asked)
        except KeyboardInterrupt:
            outcome.failure = "stopped by the operator"
        finally:
            supervisor.stop()
            runner.stop()
            thread.join(timeout=3.0)
    return outcome


def _start(supervisor: Supervisor, services: tuple[str, ...], bus: Bus, asked: CtrlC) -> None:
    """The recorder first, so that the recording misses nothing that the others say or are told."""
    listening = threading.Event()
    if "recorder" in services:
        bus.watch_alive(lambda service, alive: listening.set() if alive and service == "recorder" else None)
        supervisor.start(("recorder",))
        deadline_s = time.monotonic() + RECORDER_STARTS_S
        while not listening.wait(POLL_S) and time.monotonic() < deadline_s:
            asked.give_way()
            supervisor.watch()
    supervisor.start(service for service in services if service != "recorder")


def _follow(director: FlightDirector, supervisor: Supervisor, asked: CtrlC, keep_awake: Callable[[], object]) -> None:
    progress = Progress(director)
    began_s = time.monotonic()
    told = 0
    awake = False
    while not director.over:
        supervisor.watch()
        if not awake and time.monotonic() - began_s > STARTING_S:
            keep_awake()
            awake = True
        for incident in supervisor.incidents[told:]:
            progress.say(f"!! {incident.service} {incident.cause}: starting it again")
        told = len(supervisor.incidents)
        progress.show(began_s)
        time.sleep(POLL_S)
        asked.give_way()
    progress.say("")


def _settle(supervisor: Supervisor, asked: CtrlC) -> None:
    until_s = time.monotonic() + SETTLE_S
    while time.monotonic() < until_s:
        supervisor.watch()
        time.sleep(POLL_S)
        asked.give_way()
