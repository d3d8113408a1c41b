"""How a service runs as a process of the operating system."""

from typing import Literal

from schemas.settings.section import Section


class ProcessSettings(Section):
    """What a service asks of the operating system."""

    real_time: bool = True
    """Ask for real-time scheduling (SCHED_FIFO), so that other programs on the host do not make the landing wait. Needs the right
    to it (root, CAP_SYS_NICE, or `LimitRTPRIO=` in a systemd unit); without it the service runs as any other."""
    together: bool = True
    """Keep the services that steer (geolocator, filter, commander, and the simulator) on one of the host's processors, the last, where
    they run in real time. Pictures then do not go through its caches, and every stage of a landing is quicker. Where one computer flies
    many vehicles, set it to false: they would all take the same."""
    awake: Literal["flight", "always", "never"] = "flight"
    """When to keep the host's processors from sleeping, which makes every stage of a landing quicker and costs some watts: while
    `alight fly` flies, or as long as a service runs (for `alight run` on an aircraft), or never. Needs the right to write to
    /dev/cpu_dma_latency; where the kernel knows no sleep states (virtual machines), loops of the lowest priority do it, if the services
    run in real time."""
