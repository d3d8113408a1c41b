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
    priority = REAL_TIME.get(service)
    if real_time and priority is not None and hasattr(os, "sched_setscheduler"):
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
            return f"real-time {priority}"
    return "normal"
