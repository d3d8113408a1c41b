"""Keeps the host's processors from falling asleep between two frames.

A processor that has nothing to do sleeps, and a message that wakes it finds it slow: it comes late and its caches are empty; a
virtual machine's has been lent to somebody else meanwhile. A landing sleeps and wakes a dozen times a frame on its way through the
services. The kernel keeps processors in a light sleep for whoever holds `/dev/cpu_dma_latency` open, and from any sleep where even
the lightest gives a virtual machine's processor away; where it knows of no sleep states, as in many virtual machines, a loop of the
lowest priority on each keeps it busy and gives way to everything else.
"""

import logging
import os
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from alight.runtime.idle_loop import AUTOGROUP
from alight.runtime.priority import may_run_in_real_time

LOGGER = logging.getLogger("alight")

LATENCY_US = 10
"""How long a processor may take to wake up: sleep from which caches come back as they were."""
GIVES_AWAY = "haltpoll"
"""The driver of virtual machines whose lightest sleep says that it takes 1 us, and is the host's to end: there, none will do."""
MOST_LOOPS = 8
"""A host with more processors than this has others than us to serve."""

_LATENCY_DEVICE = Path("/dev/cpu_dma_latency")
_SLEEP_DRIVER = Path("/sys/devices/system/cpu/cpuidle/current_driver")
_CGROUPS = Path("/sys/fs/cgroup")


@contextmanager
def kept_awake(*, wanted: bool, real_time: bool) -> Iterator[str]:
    """While this is entered, the processors that this process may use do not sleep, as far as the host allows it.

    Args:
        wanted: Whether they are to be.
        real_time: Whether the services that it is done for ask for real-time scheduling, so that no loop is in their way.

    Yields:
        How, for people: `by the kernel`, `by 2 loops`, or `no: ` and the reason.
    """
    with ExitStack() as held:
        how = "no: not wanted"
        if wanted:
            driver = _sleep_driver()
            how = _by_loops(held, real_time=real_time) if driver is None else _by_the_kernel(held, driver)
            LOGGER.info("processors kept awake", extra={"how": how})
        yield how


def _by_the_kernel(held: ExitStack, driver: str) -> str:
    try:
        device = held.enter_context(_LATENCY_DEVICE.open("wb", buffering=0))
        device.write(struct.pack("i", 0 if driver == GIVES_AWAY else LATENCY_US))
    except OSError as error:
        return f"no: {error.strerror or error} ({_LATENCY_DEVICE}; let this user write to it)"
    return "by the kernel"


def _by_loops(held: ExitStack, *, real_time: bool) -> str:
    obstacle = _obstacle_to_loops(real_time=real_time)
    if obstacle:
        return f"no: {obstacle}"
    cpus = sorted(os.sched_getaffinity(0))
    try:
        for cpu in cpus:
            held.callback(_ended, _loop(cpu))
    except OSError as error:  # no process or no memory left: a flight does not end for want of a loop
        return f"no: {error.strerror or error} (a loop could not be started)"
    return f"by {len(cpus)} loops"


def _obstacle_to_loops(*, real_time: bool) -> str | None:
    """Why loops would do no good here, or harm."""
    if not hasattr(os, "SCHED_IDLE"):
        return "not on this system"
    cpus = len(os.sched_getaffinity(0))
    if cpus > MOST_LOOPS:
        return f"{cpus} processors are too many for loops"
    if has_quota(_CGROUPS):
        return "this container's time is limited, and loops would use it up"
    if not (real_time and may_run_in_real_time()):
        return "without real-time scheduling the services would have to wait for loops"
    if AUTOGROUP.exists() and not os.access(AUTOGROUP, os.W_OK):
        return f"loops would take a share of the time for themselves ({AUTOGROUP} is not to be written to)"
    return None


def _sleep_driver() -> str | None:
    """What sends processors to sleep; None where the kernel knows of no sleep states."""
    try:
        name = _SLEEP_DRIVER.read_text(encoding="ascii").strip()
    except OSError:
        return None
    return None if name == "none" else name


def has_quota(cgroups: Path) -> bool:
    """Whether the processor time of this process's control group, or of one around it, is limited.

    Args:
        cgroups: Where control groups are mounted.
    """
    try:
        lines = Path("/proc/self/cgroup").read_text(encoding="utf-8").splitlines()
    except OSError:
        return False
    paths = [line.split(":", 2)[2].strip("/") for line in lines]
    for group in {cgroups / part / path for part in ("", "cpu") for path in paths}:
        for folder in (group, *(parent for parent in group.parents if parent.is_relative_to(cgroups))):
            if _is_limited(folder / "cpu.max") or _is_limited(folder / "cpu.cfs_quota_us"):
                return True
    return False


def _is_limited(file: Path) -> bool:
    try:
        return file.read_text(encoding="ascii").split()[0] not in ("max", "-1")
    except (OSError, IndexError):
        return False


def _loop(cpu: int) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "alight.runtime.idle_loop", str(cpu), str(os.getpid())]
    # In a session of its own: the kernel weighs sessions, and its must weigh nothing (see idle_loop).
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)


def _ended(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
