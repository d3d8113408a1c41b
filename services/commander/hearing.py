"""Whether what the autopilot was last heard to say is still what it does.

A mode that is asked for on old knowledge takes the vehicle from whoever has taken it over since. Knowledge is old in two ways: nothing comes,
or what comes has waited, because this process or the link stood still, and the buffers empty in order. Either way it is current
again with the first word about the mode that follows a sample of now.
"""

from alight.runtime.clock import nanoseconds

_WAITED_NS = nanoseconds(1.0)
"""After this a word about the mode counts even if no sample is of now: where the autopilot's time is not known, or its position."""


class Hearing:
    """Begins with good ears: who has heard nothing yet has nothing old to go by."""

    def __init__(self, limit_s: float) -> None:
        """Take the limit.

        Args:
            limit_s: Silence, a pause of this process, or the age of a sample: so long all is as it was, seconds.
        """
        self._limit_ns = nanoseconds(limit_s)
        self._looked_ns: int | None = None
        self._heard_ns: int | None = None
        self._deaf_ns: int | None = None
        """When it was last known to be so."""
        self._caught_up = False
        self.times_deaf = 0
        """How often it began that the mode was not known as of now."""

    def look(self, now_ns: int) -> int:
        """Note that this process runs; called before anything else is done at `now_ns`, UTC ns.

        Returns:
            By how much the time has gone on (or back) without this process, ns; 0 if it has not.
        """
        went_on_ns = 0 if self._looked_ns is None else now_ns - self._looked_ns
        self._looked_ns = now_ns
        stood_still = not 0 <= went_on_ns <= self._limit_ns
        if stood_still and self._heard_ns is not None:
            self._heard_ns += went_on_ns
        silent = self._heard_ns is not None and now_ns - self._heard_ns > self._limit_ns
        if stood_still or silent:
            self.times_deaf += self._deaf_ns is None
            self._deaf_ns, self._caught_up = now_ns, False
        return went_on_ns if stood_still else 0

    def heard(self, now_ns: int) -> None:
        """Something has come from the autopilot."""
        self._heard_ns = now_ns

    def sampled(self, at_ns: int, now_ns: int) -> None:
        """It is a sample of the vehicle's state, taken at `at_ns`, UTC ns."""
        self._caught_up = self._caught_up or abs(now_ns - at_ns) <= self._limit_ns

    def told_mode(self, now_ns: int) -> None:
        """It names the mode that is flown."""
        if self._deaf_ns is not None and (self._caught_up or now_ns - self._deaf_ns > _WAITED_NS):
            self._deaf_ns = None

    @property
    def is_deaf(self) -> bool:
        """Whether the mode that was last named may no longer be flown."""
        return self._deaf_ns is not None
