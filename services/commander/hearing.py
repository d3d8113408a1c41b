"""Whether what the autopilot was last heard to say is still what it does.

A mode that is asked for on old knowledge takes the vehicle from whoever has taken it over since. Knowledge is old in two ways: nothing comes,
or what comes has waited, because this process or the link stood still, and the buffers empty in order. Either way it is current
again when a word about the mode has been read that was said after the pause began, and a sample of now: then all that was said before
that sample has been read, too.
"""

from alight.runtime.clock import nanoseconds, seconds

_WITHOUT_SAMPLES_NS = nanoseconds(1.0)
"""Where no samples come at all, the second word after this long counts: the first may have waited."""


class Hearing:
    """Begins with good ears: who has heard nothing yet has nothing old to go by."""

    def __init__(self, pause_s: float, fresh_s: float) -> None:
        """Take the limits.

        Args:
            pause_s: Silence, or a pause of this process: so long all is as it was, seconds.
            fresh_s: A sample up to this old is of now, seconds.
        """
        self._pause_ns = nanoseconds(pause_s)
        self._fresh_ns = nanoseconds(fresh_s)
        self._looked_ns: int | None = None
        self.heard_ns: int | None = None
        """When anything came last, UTC ns, as if the time without this process had not been; None if nothing ever did."""
        self._sample_ns = 0
        """When the newest sample was taken."""
        self._began_ns: int | None = None
        """Since when the mode is not known as of now; None if it is."""
        self._words = 0
        self._told = self._sampled = self._caught_up = False
        self.times_deaf = 0
        """How often it began that the mode was not known as of now."""

    def look(self, now_ns: int) -> int:
        """Note that this process runs; called before anything else is done at `now_ns`, UTC ns.

        Returns:
            By how much the time has gone on (or back) without this process, ns; 0 if it has not.
        """
        went_on_ns = 0 if self._looked_ns is None else now_ns - self._looked_ns
        self._looked_ns = now_ns
        if not 0 <= went_on_ns <= self._pause_ns:
            self.heard_ns = None if self.heard_ns is None else self.heard_ns + went_on_ns
            self._begin(now_ns)
            return went_on_ns
        if self.heard_ns is not None and now_ns - self.heard_ns > self._pause_ns:
            self._begin(self.heard_ns)
        return 0

    def heard(self, now_ns: int) -> None:
        """Something has come from the autopilot."""
        self.heard_ns = now_ns

    def sampled(self, at_ns: int, now_ns: int) -> None:
        """It is a sample of the vehicle's state, taken at `at_ns`, UTC ns."""
        self._sample_ns = at_ns
        self._sampled = True
        self._caught_up = self._caught_up or abs(now_ns - at_ns) <= self._fresh_ns
        if self._told and self._caught_up:
            self._end()

    def told_mode(self, now_ns: int) -> None:
        """It names the mode that is flown."""
        if self._began_ns is None:
            return
        self._words += 1
        self._told = self._told or self._sample_ns >= self._began_ns
        without_samples = not self._sampled and self._words > 1 and now_ns - self._began_ns > _WITHOUT_SAMPLES_NS
        if without_samples or (self._told and self._caught_up):
            self._end()

    def deaf_for_s(self, now_ns: int) -> float | None:
        """For how long it has been that the mode that was last named may no longer be flown, seconds; None if it is."""
        return None if self._began_ns is None else seconds(max(0, now_ns - self._began_ns))

    def _begin(self, began_ns: int) -> None:
        if self._began_ns is None:
            self.times_deaf += 1
            self._words = 0
            self._told = self._sampled = False
            self._began_ns = began_ns
        self._caught_up = False

    def _end(self) -> None:
        self._began_ns = None
        self._told = False
