"""How a service runs as a process of the operating system."""

from schemas.settings.section import Section


class ProcessSettings(Section):
    """What a service asks of the operating system."""

    real_time: bool = True
    """Ask for real-time scheduling (SCHED_FIFO), so that other programs on the host do not make the landing wait. Needs the right
    to it (root, CAP_SYS_NICE, or `LimitRTPRIO=` in a systemd unit); without it the service runs as any other."""
