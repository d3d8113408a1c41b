"""Which flight mode is ours: the one that was asked for and is flown, and while it is awaited also the one before."""

from alight.runtime.clock import seconds
from schemas.vehicle import FlightMode, VehicleStatus


class ModeAuthority:
    """Tells a mode that the commander asked for from one that a pilot or a failsafe chose."""

    def __init__(self) -> None:
        self._held: FlightMode | None = None
        self._wanted: FlightMode | None = None
        self._before = FlightMode.UNKNOWN
        self._asked_ns = 0

    def ask(self, mode: FlightMode, status: VehicleStatus, now_ns: int) -> None:
        """Note that a mode is asked for now. Asked anew, it keeps the time of the first asking."""
        if self._wanted is mode:
            return
        self._wanted, self._before, self._asked_ns = mode, status.mode, now_ns
        self.look(status)

    def adopt(self, mode: FlightMode) -> None:
        """Take the mode that is flown for our own."""
        self._held, self._wanted = mode, None

    def release(self) -> None:
        """Nothing is ours any more: any mode is fine."""
        self._held = self._wanted = None

    def look(self, status: VehicleStatus) -> None:
        """Compare with what is flown. PX4 goes from TAKEOFF to HOLD by itself."""
        if self._wanted is not None and status.mode is self._wanted:
            self.adopt(self._wanted)
        elif self._held is FlightMode.TAKEOFF and status.mode is FlightMode.HOLD:
            self.adopt(FlightMode.HOLD)

    @property
    def expected(self) -> tuple[FlightMode, ...]:
        """The modes that are no surprise; empty if any is fine."""
        if self._wanted is not None:
            return (self._before, self._wanted)
        return () if self._held is None else (self._held,)

    def taken(self, status: VehicleStatus) -> bool:
        """Whether somebody else chose the mode."""
        return bool(self.expected) and status.mode not in self.expected

    def overdue_s(self, now_ns: int) -> float | None:
        """Since when the wanted mode is awaited, seconds; None if none is."""
        return None if self._wanted is None else seconds(now_ns - self._asked_ns)
