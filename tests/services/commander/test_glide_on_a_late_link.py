"""A link that is slow, but not so slow that the vehicle's state counts as stale, as a telemetry radio is."""

from collections import deque
from collections.abc import Callable, Iterator

import pytest
import simulated_flight
from simulated_flight import SimulatedFlight

from alight.runtime.clock import nanoseconds
from alight.runtime.node import Output, Outputs, Transmission
from schemas.mission import Phase, Verb
from schemas.settings import Settings
from services.simulator.node import SimulatorNode

Fly = Callable[[float], SimulatedFlight]


@pytest.fixture
def fly(monkeypatch: pytest.MonkeyPatch) -> Fly:
    def begin(one_way_s: float) -> SimulatedFlight:
        class LateSimulator(SimulatorNode):
            """All bytes are on the way for a while, in either direction."""

            def __init__(self, settings: Settings) -> None:
                super().__init__(settings)
                self._coming: deque[tuple[int, str, bytes]] = deque()
                self._going: deque[tuple[int, Output]] = deque()

            def on_bytes(self, port: str, data: bytes, now_ns: int) -> Outputs:
                self._coming.append((now_ns + nanoseconds(one_way_s), port, data))
                return ()

            def on_tick(self, now_ns: int) -> Iterator[Output]:
                outputs: list[Output] = []
                while self._coming and self._coming[0][0] <= now_ns:
                    outputs += super().on_bytes(*self._coming.popleft()[1:], now_ns)
                for output in (*outputs, *super().on_tick(now_ns)):
                    if isinstance(output, Transmission):
                        self._going.append((now_ns + nanoseconds(one_way_s), output))
                    else:
                        yield output
                while self._going and self._going[0][0] <= now_ns:
                    yield self._going.popleft()[1]

        monkeypatch.setattr(simulated_flight, "SimulatorNode", LateSimulator)
        return SimulatedFlight(from_pad_m=(6.0, 5.0, -12.0))

    return begin


@pytest.mark.parametrize("one_way_s", [0.1, 0.2, 0.3])
def test_it_lands_without_swinging(fly: Fly, one_way_s: float) -> None:
    flight = fly(one_way_s)
    fastest_mps = 0.0

    def landed() -> bool:
        nonlocal fastest_mps
        assert flight.pad.state is not None
        north, east, _ = flight.pad.state.velocity_ned_mps
        fastest_mps = max(fastest_mps, (north**2 + east**2) ** 0.5)
        return flight.person.phase is Phase.LANDED

    flight.ask(Verb.LAND)
    flight.until(landed, 60.0)
    assert flight.beside_m < 0.15
    assert fastest_mps < 1.3 * flight.settings.commander.glide.max_horizontal_mps
