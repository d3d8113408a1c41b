"""`alight replay FLIGHT` without `--through`: the flight once more on the bus."""

import argparse
import logging
import os
import sys
import time
import uuid
from collections.abc import Callable

from alight.runtime.bus import Bus, BusError
from alight.runtime.clock import seconds
from alight.runtime.settings_file import SettingsError, load_settings
from schemas.frame import FrameHeader
from schemas.settings import Settings
from schemas.topics import SERVICES
from station.flight_record import FlightRecord, read_flight
from station.live_flight import rendezvous
from station.republish.choice import REPLAY, choose, conflict
from station.republish.excerpt import Item, excerpt, recorded_topics
from station.republish.pace import PatientWallClock, steadily, stepwise
from station.republish.player import Player
from station.republish.presence import Presence
from station.republish.words import how_it_went, what_is_published

LOOK_S = 2.5
"""How long to look who lives on the bus; who looks for this end of it does so every 2 s at least."""
SETTLE_S = 0.5
"""A service shows that it lives just before it subscribes."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the options."""
    group = parser.add_argument_group("on the bus (without --through)")
    pace = group.add_mutually_exclusive_group()
    pace.add_argument("--speed", type=_speed, default=1.0, metavar="N", help="so many times as fast as it was flown")
    pace.add_argument("--step", action="store_true", help="a frame at a time: Enter goes on to the next one")
    group.add_argument("--from", dest="from_s", type=float, default=0.0, metavar="S", help="begin so many seconds in")
    group.add_argument("--to", dest="to_s", type=float, metavar="S", help="end so many seconds in")
    group.add_argument("--topics", type=_names, metavar="NAME,...", help="publish these topics only")
    group.add_argument("--without", type=_names, default=(), metavar="NAME,...", help="leave these topics out")
    group.add_argument("--original-time", action="store_true", help="leave the stamps as they were recorded")
    group.add_argument(
        "--wait-for",
        type=_services,
        default=(),
        metavar="SERVICE,...",
        help="begin when these services live on the bus",
    )
    group.add_argument("--wait", type=float, default=60.0, metavar="S", help="wait for them so long (default 60)")


def run(arguments: argparse.Namespace) -> int:
    """Publish the flight; the exit status."""
    # What Zenoh or a library logs must not come between the lines that a person reads.
    logging.getLogger("alight").addHandler(logging.NullHandler())
    try:
        if len(arguments.flights) != 1:
            raise ValueError("one flight at a time goes onto the bus; several only with --through")
        record = read_flight(arguments.flights[0])
        settings = load_settings(arguments.settings, os.environ, arguments.set)
        bus = _join(settings)
    except (SettingsError, BusError, ValueError, OSError) as error:
        sys.stderr.write(f"alight replay: {error}\n")
        return 2
    try:
        return _replay(record, bus, arguments)
    except ValueError as error:
        sys.stderr.write(f"alight replay: {error}\n")
        return 2
    finally:
        bus.close()


def _join(settings: Settings) -> Bus:
    """At the place where services look for the others; where somebody is there already, beside it."""
    try:
        return Bus(settings.vehicle, rendezvous(settings.bus))
    except BusError:
        return Bus(settings.vehicle, settings.bus)


def _replay(record: FlightRecord, bus: Bus, arguments: argparse.Namespace) -> int:
    presence = Presence()
    bus.watch_alive(presence.note)
    missing = _look(presence, frozenset(arguments.wait_for), arguments.wait)
    if missing:
        sys.stderr.write(
            f"alight replay: {', '.join(missing)} did not come within {arguments.wait:g} s: start with `alight run SERVICE`\n"
        )
        return 1
    choice = choose(recorded_topics(record), presence.services, arguments.topics, arguments.without)
    part = excerpt(record, choice.published, arguments.from_s, arguments.to_s)
    bus.announce(f"{REPLAY}{uuid.uuid4().hex[:8]}")
    clock = PatientWallClock()
    for line in what_is_published(choice, part, pace=_pace(arguments), now_ns=_now_ns(arguments, clock)):
        print(line, flush=True)
    player = Player(bus.publish, record.picture, clock, original_time=arguments.original_time, paced=not arguments.step)
    due = stepwise(part, clock, _asking(part.began_ns)) if arguments.step else steadily(part, clock, arguments.speed)
    try:
        player.play(due, lambda topic: conflict(topic, presence.services, named=arguments.topics is not None))
        time.sleep(SETTLE_S)  # the last messages leave the process
    finally:
        for line in how_it_went(player.played):
            print(line)
    return 0


def _pace(arguments: argparse.Namespace) -> str:
    return "a frame at a time" if arguments.step else f"at {arguments.speed:g}x"


def _now_ns(arguments: argparse.Namespace, clock: PatientWallClock) -> int | None:
    return None if arguments.original_time else clock.now_ns()


def _look(presence: Presence, wanted: frozenset[str], wait_s: float) -> list[str]:
    """Look around, at least once all over the bus; returns which of the wanted services have not come in time."""
    began_s = time.monotonic()
    waited_s = 0.0
    while waited_s < LOOK_S or (waited_s < wait_s and wanted - presence.services):
        time.sleep(0.05)
        waited_s = time.monotonic() - began_s
    time.sleep(SETTLE_S)
    return sorted(wanted - presence.services)


def _asking(began_ns: int) -> Callable[[Item], bool]:
    def go_on(last: Item) -> bool:
        what = (
            f"frame {last.message.sequence}" if isinstance(last.message, FrameHeader) else "what follows the last frame"
        )
        try:
            input(f"{seconds(last.at_ns - began_ns):8.2f} s  Enter: {what} ")
        except EOFError:
            print()
            return False
        return True

    return go_on


def _names(text: str) -> tuple[str, ...]:
    return tuple(name for name in text.split(",") if name)


def _services(text: str) -> tuple[str, ...]:
    names = _names(text)
    unknown = sorted(set(names) - SERVICES)
    if unknown:
        raise argparse.ArgumentTypeError(f"no such service: {unknown[0]}; there are {', '.join(sorted(SERVICES))}")
    return names


def _speed(text: str) -> float:
    speed = float(text)
    if not 0.01 <= speed <= 1000.0:
        raise argparse.ArgumentTypeError("between 0.01 and 1000")
    return speed
