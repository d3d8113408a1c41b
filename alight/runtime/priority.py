"""Which services the operating system runs first, where it lets us say so."""

import contextlib
import os
from collections.abc import Mapping

REAL_TIME: Mapping[str, int] = {
    "commander": 40,
    "filter": 35,
    "geolocator": 30,
    "simulator": 25,
    "detector": 20,
    "camera": 15,
}
"""Priority under SCHED_FIFO. The nearer to the vehicle, the higher: what is almost at the setpoint is finished before a new
picture is begun. They leave room above for what the host itself needs in time and below for other programs."""

IN_THE_BACKGROUND: Mapping[str, int] = {"recorder": 10}
"""Niceness of the services that must never make those wait that steer."""


def prioritise(service: str, *, real_time: bool) -> str:
    """Give this process its priority; to be called while it has one thread, since later ones inherit it.

    Without the right to real-time scheduling (root, CAP_SYS_NICE or `ulimit -r`), and on other systems than Linux, the
    process stays as it is: it works, but other programs on the host may make it wait.

    Returns:
        What it runs with, for the log: `real-time 40`, `nice 10` or `normal`.
    """
    if service in IN_THE_BACKGROUND:
        return f"nice {os.nice(IN_THE_BACKGROUND[service])}"
    if real_time and _schedule(0, service):
        return f"real-time {REAL_TIME[service]}"
    return "normal"


def hasten(pid: int, service: str) -> None:
    """Give a process that has just been started its real-time priority before it has loaded anything.

    A service that is started again in flight otherwise loads behind all that run already: on a busy host that takes ten times
    as long, and the vehicle waits for it. Where that is not allowed, nothing happens.
    """
    _schedule(pid, service)


def may_run_in_real_time() -> bool:
    """Whether this process has the right to every priority above; it is tried, since rights to it come by many ways."""
    if not hasattr(os, "sched_setscheduler"):
        return False
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    if not _schedule(0, max(REAL_TIME, key=REAL_TIME.__getitem__)):
        return False
    os.sched_setscheduler(0, policy, parameters)
    return True


def _schedule(pid: int, service: str) -> bool:
    """Whether the process has the service's real-time priority now."""
    priority = REAL_TIME.get(service)
    if priority is None or not hasattr(os, "sched_setscheduler"):
        return False
    with contextlib.suppress(OSError):
        os.sched_setscheduler(pid, os.SCHED_FIFO, os.sched_param(priority))
        return True
    return False
