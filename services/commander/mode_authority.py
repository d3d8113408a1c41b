"""Which flight mode is ours: the one that was asked for and is flown, and while it is awaited also the one before."""

from alight.runtime.clock import seconds
from schemas.vehicle import FlightMode, VehicleStatus


class ModeAuthority:
    """Tells a mode that the commander asked for from one that a pilot or a failsafe chose."""

    def __init__(self) -> None:
        self._held: FlightMode | None = None
        self._wanted: FlightMode | None = None
        self._before = FlightMode.UNKNOWN
        self._late: tuple[FlightMode, ...] = ()
        self._asked_ns = 0

    def ask(self, mode: FlightMode, status: VehicleStatus, now_ns: int, late: tuple[FlightMode, ...] = ()) -> None:
        """Note that a mode is asked for now. Asked anew, it keeps the time of the first asking.

        `late` are modes that were asked for before and may still come, even after the one that is asked for now.
        """
        if self._wanted is mode:
            return
        self._late = late
        self._wanted, self._before, self._asked_ns = mode, status.mode, now_ns
        self.look(status)

    def adopt(self, mode: FlightMode) -> None:
        """Take the mode that is flown for our own."""
        self._held, self._wanted = mode, None

    def release(self) -> None:
        """Nothing is ours any more: any mode is fine."""
        self._held = self._wanted = None
        self._late = ()

    def look(self, status: VehicleStatus) -> None:
        """Compare with what is flown. PX4 goes from TAKEOFF to HOLD by itself."""
        if self._wanted is not None and status.mode is self._wanted:
            self.adopt(self._wanted)
        elif self._held is FlightMode.TAKEOFF and status.mode is FlightMode.HOLD:
            self.adopt(FlightMode.HOLD)
        elif self._held is not None and status.mode in self._late:
            self._wanted, self._before = self._held, status.mode

    @property
    def expected(self) -> tuple[FlightMode, ...]:
        """The modes that are no surprise; empty if any is fine."""
        if self._wanted is not None:
            return (self._before, self._wanted, *self._late)
        return () if self._held is None else (self._held, *self._late)

    def taken(self, status: VehicleStatus) -> bool:
        """Whether somebody else chose the mode."""
        return bool(self.expected) and status.mode not in self.expected

    def overdue_s(self, now_ns: int) -> float | None:
        """Since when the wanted mode is awaited, seconds; None if none is."""
        return None if self._wanted is None else seconds(now_ns - self._asked_ns)
