"""How much faster the autopilot's clock runs than ours, over a minute."""

from collections import deque

from alight.runtime.clock import nanoseconds

SPACING_NS = nanoseconds(1.0)
"""Of all replies within one second that with the shortest round trip is kept: it is wrong by the least."""
SPAN_NS = nanoseconds(60.0)
LEAST_SPAN_NS = nanoseconds(10.0)
"""Over less, the jitter of the link is taken for a drift."""


class ClockDrift:
    """A straight line through one reply a second. For people: what is mapped follows the quicker line of `AutopilotClock`."""

    def __init__(self) -> None:
        self._kept: deque[tuple[int, int, int]] = deque()

    def take(self, boot_ns: int, offset_ns: int, round_trip_ns: int) -> None:
        """Take a reply: the autopilot's time since boot, UTC minus that, and how long it was on the way, ns."""
        if self._kept and boot_ns - self._kept[-1][0] < SPACING_NS:
            if round_trip_ns < self._kept[-1][2]:
                self._kept[-1] = (boot_ns, offset_ns, round_trip_ns)
            return
        self._kept.append((boot_ns, offset_ns, round_trip_ns))
        while boot_ns - self._kept[0][0] > SPAN_NS:
            self._kept.popleft()

    @property
    def ppm(self) -> float | None:
        """Parts per million, positive if it runs fast; None before ten seconds.

        UTC minus boot time falls as the boot time gains: its slope is the drift with the other sign, per second of boot time.
        """
        if not self._kept or self._kept[-1][0] - self._kept[0][0] < LEAST_SPAN_NS:
            return None
        first_boot_ns, first_offset_ns, _ = self._kept[0]
        x = [float(boot_ns - first_boot_ns) for boot_ns, _, _ in self._kept]
        y = [float(offset_ns - first_offset_ns) for _, offset_ns, _ in self._kept]
        mean_x, mean_y = sum(x) / len(x), sum(y) / len(y)
        slope = sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y, strict=True)) / sum((a - mean_x) ** 2 for a in x)
        return -1e6 * slope / (1.0 + slope)
