"""What `python -m services.NAME` does: settings, logs, ports, node, run until told to stop."""

import argparse
import importlib
import logging
import os
import signal
import sys
import threading
import time
from pathlib import Path

from alight.runtime.bus import BusError
from alight.runtime.garbage_collection import GarbageCollection
from alight.runtime.live import LiveRunner
from alight.runtime.logs import configure_logs
from alight.runtime.placement import gather
from alight.runtime.port import PortError
from alight.runtime.priority import prioritise
from alight.runtime.settings_file import SettingsError, load_settings
from alight.runtime.wakefulness import kept_awake

LOGGER = logging.getLogger("alight")

SWITCH_INTERVAL_S = 0.0005
"""How long the node's thread may keep the interpreter from a receiving one; Python's default is 5 ms."""


def add_service_arguments(parser: argparse.ArgumentParser) -> None:
    """The options that every service takes."""
    parser.add_argument("--settings", type=Path, metavar="FILE", help="TOML file with the settings (default: built in)")
    parser.add_argument(
        "--set", action="append", default=[], metavar="SECTION.KEY=VALUE", help="set one key; repeatable"
    )
    parser.add_argument(
        "--exit-with-parent", action="store_true", help="stop when the process that started this one is gone"
    )


def main(name: str) -> int:
    """Entry point of `python -m services.NAME`; the exit status is 2 where the settings or a port are at fault."""
    parser = argparse.ArgumentParser(prog=f"python -m services.{name}", description=f"Run Alight's {name} service.")
    add_service_arguments(parser)
    return run_service(name, parser.parse_args())


def run_service(name: str, arguments: argparse.Namespace) -> int:
    """Run one service in this process until SIGINT or SIGTERM."""
    try:
        settings = load_settings(arguments.settings, os.environ, arguments.set)
        configure_logs(name)
        priority = prioritise(name, real_time=settings.process.real_time)
        service = importlib.import_module(f"services.{name}.service")
        # A service whose adapters need the host's clock, a thread or a warm start builds its node in another way than in lockstep.
        build = getattr(service, "build_live", service.build)
        runner = LiveRunner(build(settings), settings, service.open_ports(settings))
    except (SettingsError, PortError, BusError, ValueError) as error:
        sys.stderr.write(f"alight {name}: {error}\n")
        return 2
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: runner.stop())
    if arguments.exit_with_parent:
        threading.Thread(target=_watch_parent, args=(os.getppid(), runner), daemon=True).start()
    _favour_latency()
    facts = {"pid": os.getpid(), "vehicle": settings.vehicle, "priority": priority}
    LOGGER.info("service started", extra={**facts, "runs_on": gather(name, wanted=settings.process.together)})
    # Whoever supervises this process keeps the processors awake for all of them.
    wanted = settings.process.awake == "always" and not arguments.exit_with_parent
    with kept_awake(wanted=wanted, real_time=settings.process.real_time):
        runner.run()
    LOGGER.info("service stopped")
    return 0


def _favour_latency() -> None:
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    GarbageCollection.begin()


def _watch_parent(parent: int, runner: LiveRunner) -> None:
    while os.getppid() == parent:
        time.sleep(0.5)
    LOGGER.error("the supervisor is gone: stopping")
    runner.stop()
