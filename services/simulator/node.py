"""The simulator's node: a vehicle with its autopilot, a little ahead of the clock."""

from collections.abc import Mapping

from alight.runtime.clock import nanoseconds
from alight.runtime.node import Node, Output, Outputs, Publication, Transmission
from schemas.settings import Settings
from schemas.topics import GROUND_TRUTH
from services.simulator.mavlink.station import Station
from services.simulator.vehicle import STEP_NS, Vehicle

LATE_NS = 500_000_000
"""Further behind than this, the missed time is skipped instead of computed."""


class SimulatorNode(Node):
    """Simulates vehicle, autopilot and world in fixed steps of 4 ms.

    Two times. The *clock* is what everybody shares; the *simulated time* runs `lead_s` ahead of it, because the renderer needs the truth of
    a moment before it can have drawn that moment's picture. When the clock says t, the vehicle has been computed up to t + lead:

      - GROUND_TRUTH is published at once, stamped with the state's own time, up to `lead_s` in the future;
      - telemetry of the state at time s carries s in its stamps and is held back until the clock says s (`release_at_ns`), so whoever reads
        it sees an autopilot without any lead;
      - replies (acknowledgements, TIMESYNC, parameters, pings) leave at once. TIMESYNC tells the clock, not the simulated time: boot time =
        clock - boot. So `time_boot_ms` of the telemetry and TIMESYNC speak of one time base, exactly.

    The price: a command that arrives at t acts on the vehicle of t + lead, as if the link had `lead_s` more delay.

    A process that was busy catches up step by step. After more than 0.5 s the missed time is skipped: the vehicle stood still meanwhile, the
    stamps jump, and the counter `skipped_ms` says by how much.
    """

    service = "simulator"
    tick_period_ns = STEP_NS

    def __init__(self, settings: Settings) -> None:
        super().__init__()
        simulator = settings.simulator
        self.ports = ("vehicle", "gcs") if simulator.gcs_url else ("vehicle",)
        self.vehicle = vehicle = Vehicle(settings)
        self._station = Station(simulator.system_id, self.ports, vehicle.autopilot, vehicle.estimate, vehicle.world)
        self._telemetry = self._station.telemetry
        self._lead_ns = nanoseconds(simulator.lead_s)
        self._truth_period_ns = nanoseconds(1.0 / simulator.truth_hz)
        self._boot_ns: int | None = None
        self._time_ns = 0
        self._truth_due_ns = 0
        self._skipped_ns = 0

    def on_tick(self, now_ns: int) -> Outputs:
        """Compute up to `now_ns` plus the lead."""
        if self._boot_ns is None:
            self._time_ns = self._truth_due_ns = now_ns
            self._boot_ns = now_ns - nanoseconds(self.vehicle.autopilot.now_s)
        behind_ns = now_ns + self._lead_ns - self._time_ns
        if behind_ns > LATE_NS + self._lead_ns:
            skipped_ns = (behind_ns - self._lead_ns) // STEP_NS * STEP_NS
            self._skip(skipped_ns)
        return self._run_to(now_ns + self._lead_ns)

    def on_bytes(self, port: str, data: bytes, now_ns: int) -> Outputs:
        """Take MAVLink; the replies leave at once."""
        clock_ns = max(1, now_ns - self._boot_ns) if self._boot_ns is not None else 1
        return [Transmission(to, reply) for to, reply in self._station.receive(port, data, clock_ns)]

    def counters(self) -> Mapping[str, int]:
        """See `Node.counters`."""
        station = self._station
        return {
            "skipped_ms": self._skipped_ns // 1_000_000,
            "refused_mavlink": station.refused_bytes,
            "foreign_mavlink": station.foreign,
            "dropped_setpoints": station.dropped_setpoints,
        }

    def _run_to(self, until_ns: int) -> list[Output]:
        vehicle, station = self.vehicle, self._station
        out: list[Output] = []
        while self._time_ns + STEP_NS <= until_ns:
            self._time_ns += STEP_NS
            vehicle.step()
            if self._time_ns >= self._truth_due_ns:
                self._truth_due_ns = max(
                    self._truth_due_ns + self._truth_period_ns, self._time_ns - self._truth_period_ns
                )
                out.append(Publication(GROUND_TRUTH, vehicle.ground_truth(self._time_ns)))
            self._telemetry.utc_ns = self._time_ns
            out += [Transmission(port, data, release_at_ns=self._time_ns) for port, data in station.due()]
        return out

    def _skip(self, skipped_ns: int) -> None:
        self._skipped_ns += skipped_ns
        self._time_ns += skipped_ns
        self._telemetry.skipped_s += skipped_ns * 1e-9
