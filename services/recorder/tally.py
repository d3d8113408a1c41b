"""What became of what the recorder was given."""

from dataclasses import asdict, dataclass


@dataclass
class Tally:
    """Counts since the recorder's start. One thread writes each of them; any may read."""

    recorded: int = 0
    """Messages and pictures in the file."""
    lost_disk: int = 0
    """Lost because the disk took no more."""
    lost_backlog: int = 0
    """Lost because more was waiting for the disk than `recorder.backlog_mb`."""
    lost_unknown: int = 0
    """Not kept: from a service that the table of topics does not know."""
    pictures_refused: int = 0
    """Frames that made no picture."""
    not_wanted: int = 0
    """Forgotten before a landing was asked for (`recorder.pre_trigger_s`)."""
    parts: int = 0
    """Files begun."""
    lag_max_us: int = 0
    """Longest time from arrival to the file, microseconds; 0 in lockstep."""
    at_risk_max_us: int = 0
    """Longest time from arrival until the operating system had it: what a crash would have lost at most; 0 in lockstep."""

    @property
    def lost(self) -> int:
        """Everything that should be in the file and is not."""
        return self.lost_disk + self.lost_backlog

    def counters(self) -> dict[str, int]:
        """For `health`."""
        return asdict(self)
