"""How the autopilot answers a command: MAV_RESULT."""

from enum import IntEnum


class Result(IntEnum):
    """The numbers of MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
