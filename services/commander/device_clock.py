"""The time of a component that has a clock of its own and answers no TIMESYNC, brought to UTC."""

from alight.runtime.clock import nanoseconds
from services.commander.autopilot_clock import AutopilotClock

MAX_LATE_NS = nanoseconds(0.1)
"""A message that seems to have been under way for longer than this comes of a clock that was set anew, stands still or runs slowly."""


class DeviceClock:
    """Maps boot time to UTC by the quickest of the messages of the last two seconds.

    What comes out is too late by what that one was under way, and never by more than the message itself was, nor too early by more
    than `MAX_LATE_NS`: whatever the clock does, a stamp is near the arrival.
    """

    def __init__(self) -> None:
        self._clock = AutopilotClock()

    def utc_ns(self, boot_ns: int, now_ns: int) -> int:
        """When a message was made, UTC ns.

        Args:
            boot_ns: The time that it carries, ns since the component booted.
            now_ns: When it came, UTC ns.
        """
        at_ns = self._mapped_ns(boot_ns, now_ns)
        if now_ns - at_ns > MAX_LATE_NS:
            self._clock.reset()
            at_ns = self._mapped_ns(boot_ns, now_ns)
        return at_ns

    def _mapped_ns(self, boot_ns: int, now_ns: int) -> int:
        self._clock.take_arrival(boot_ns, now_ns)
        at_ns = self._clock.utc_ns(boot_ns)
        assert at_ns is not None, "an arrival has just been taken"
        return at_ns
