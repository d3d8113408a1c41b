"""Near the ground the coordinates change under a vehicle that has not moved, or the pad is seen elsewhere all of a sudden."""

import math

import pytest
from simulated_flight import SimulatedFlight

from alight.geometry.local import moved_by_ned
from schemas.mission import Phase, Verb

FROM_PAD_M = (0.5, 0.3, -6.0)
REACH_M = 0.3


class Descent:
    """A descent to the pad, watched by the ground truth from a height on."""

    def __init__(self, height_m: float) -> None:
        self.flight = SimulatedFlight(from_pad_m=FROM_PAD_M)
        self.flight.ask(Verb.LAND)
        self.flight.until(lambda: self.flight.height_m < height_m)
        body = self.flight.simulator.vehicle.body
        self.began_m = (body.north_m, body.east_m)
        self.fastest_sideways_mps = 0.0
        self.contact_mps = (0.0, 0.0)
        """Sideways and down, just before the ground is touched."""
        self._touched = False

    def land(self) -> None:
        self.flight.until(self._is_over, 40.0)

    def _is_over(self) -> bool:
        body = self.flight.simulator.vehicle.body
        if not self._touched:
            self._touched = body.touching_ground
            self.fastest_sideways_mps = max(self.fastest_sideways_mps, math.hypot(body.vn, body.ve))
            if not self._touched:
                self.contact_mps = (math.hypot(body.vn, body.ve), body.vd)
        return self.flight.person.phase in (Phase.LANDED, Phase.ABORTED, Phase.FAILED, Phase.YIELDED)

    @property
    def moved_m(self) -> float:
        body = self.flight.simulator.vehicle.body
        return math.dist(self.began_m, (body.north_m, body.east_m))


@pytest.mark.parametrize("height_m", [0.75, 0.95, 2.0])
@pytest.mark.parametrize("jump_m", [0.5, 2.0, 4.0])
def test_a_reset_of_the_estimator_moves_the_pad_and_not_the_vehicle(height_m: float, jump_m: float) -> None:
    descent = Descent(height_m)
    descent.flight.reset_estimator((jump_m, 0.0, 0.0))
    descent.land()
    assert descent.flight.person.phase is Phase.LANDED
    assert descent.fastest_sideways_mps < 0.4
    assert descent.moved_m < REACH_M


@pytest.mark.parametrize("height_m", [1.3, 2.5])
@pytest.mark.parametrize("jump_m", [-2.0, 2.0])
def test_a_reset_of_the_altitude_makes_it_neither_fall_nor_stay_up(height_m: float, jump_m: float) -> None:
    descent = Descent(height_m)
    descent.flight.reset_estimator((0.0, 0.0, jump_m))
    descent.land()
    assert descent.flight.person.phase is Phase.LANDED
    assert descent.contact_mps[1] < 0.7
    assert descent.moved_m < REACH_M


@pytest.mark.parametrize("height_m", [0.75, 0.95])
def test_a_pad_that_is_suddenly_seen_beside_is_not_run_after_in_the_touchdown(height_m: float) -> None:
    """By less than the gate holds back: a print that is half covered, or estimates that began anew."""
    descent = Descent(height_m)
    assert descent.flight.pad.pad is not None
    descent.flight.pad.pad = moved_by_ned(descent.flight.pad.pad, (0.9, 0.0, 0.0))
    descent.land()
    assert descent.flight.person.phase is Phase.LANDED
    assert descent.contact_mps[0] < 0.45
