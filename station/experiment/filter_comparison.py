"""Filters side by side over many flights, on the same fixes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from schemas.settings import Settings
from schemas.settings.filter import FilterSettings
from station.experiment.consistency import Nees, nees
from station.experiment.filter_score import Claim, FlightScore, FlightTruth, estimate_score, fix_claims, lag_s
from station.experiment.refilter import filtered, recorded_fixes, relocated_fixes
from station.flight_record import FlightRecord, read_flight

Array = NDArray[np.float64]

HEIGHTS_M = (15.0, 12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0)
"""Heights above the pad at which one claim of each flight is judged."""
_NEAR_PART = 0.2
"""How much lower than such a height the claim may be made, as a part of it."""


class ComparisonError(Exception):
    """A recording that cannot be compared on. One line."""


@dataclass
class Contestant:
    """One filter over all flights so far."""

    name: str
    flights: list[FlightScore] = field(default_factory=list)

    @property
    def claims(self) -> list[Claim]:
        """All estimates of all flights."""
        return [claim for flight in self.flights for claim in flight.claims]

    def last_errors_m(self) -> Array:
        """(N, 3), of the last estimate before the touchdown of each flight."""
        return np.array([flight.claims[-1].error_m for flight in self.flights if flight.claims]).reshape(-1, 3)

    def last_nees(self) -> Nees | None:
        """NEES of the same."""
        last = [flight.claims[-1] for flight in self.flights if flight.claims]
        return nees([claim.error_m for claim in last], [claim.covariance_m2 for claim in last])

    def at_height(self, height_m: float) -> list[Claim]:
        """The first claim of each flight at or below a height."""
        found = []
        for flight in self.flights:
            claim = next((one for one in flight.claims if one.height_m <= height_m), None)
            if claim is not None and claim.height_m > (1.0 - _NEAR_PART) * height_m:
                found.append(claim)
        return found

    def nees_at(self, height_m: float) -> Nees | None:
        """NEES at a height, one claim of each flight."""
        claims = self.at_height(height_m)
        return nees([claim.error_m for claim in claims], [claim.covariance_m2 for claim in claims])

    def lag_s(self) -> float | None:
        """See `filter_score.lag_s`, over all flights."""
        return lag_s(self.claims)


@dataclass
class Comparison:
    """What came out."""

    contestants: dict[str, Contestant]
    """By name; the fixes themselves are `fixes`, where they say what they share."""
    count: int = 0
    """Flights."""
    fixes: int = 0
    """Accepted fixes before the touchdown that were not outliers."""
    outliers: int = 0
    """Fixes that `kalman` refused."""


FIXES, LATEST = "fixes", "latest pose"
WAYS: tuple[Literal["pnp", "bearing", "fused"], ...] = ("pnp", "bearing", "fused")
"""Ways to a fix, compared where the pad's altitude is known."""


def compare(
    recordings: Sequence[Path],
    methods: Mapping[str, FilterSettings | str],
    overridden: Callable[[FlightRecord], Settings],
    *,
    relocate: bool,
    on_done: Callable[[int], None] = lambda _done: None,
) -> Comparison:
    """Run each filter over the fixes of each flight and score it.

    Args:
        recordings: Files or folders.
        methods: By name: a method with the flight's own settings, or settings of its own.
        overridden: Settings of a flight, with whatever the caller changes.
        relocate: Let today's geolocator make the fixes from the recorded detections, and show besides what taking the latest
            pose instead of that at capture time costs, and the other ways to a fix; otherwise the fixes are those of the flight.
        on_done: Told how many flights are done.

    Raises:
        ComparisonError: If a recording lacks the ground truth or its settings.
        FlightRecordError: If it cannot be read.
    """
    names = [FIXES, *methods, *([f"kalman, {LATEST}", f"none, {LATEST}"] if relocate else [])]
    if relocate:
        names += [name for way in WAYS for name in (f"{FIXES}, {way}", f"kalman, {way}")]
    result = Comparison({name: Contestant(name) for name in names})
    for path in recordings:
        record = read_flight(path)
        truth = FlightTruth.of(record)
        if not len(truth.track.times_ns):
            raise ComparisonError(f"{path}: has no ground truth to compare with")
        _compare_one(record, truth, methods, overridden(record), relocate, result)
        result.count += 1
        on_done(result.count)
    return result


def _compare_one(
    record: FlightRecord,
    truth: FlightTruth,
    methods: Mapping[str, FilterSettings | str],
    settings: Settings,
    relocate: bool,
    result: Comparison,
) -> None:
    fixes = relocated_fixes(record, settings, "capture") if relocate else recorded_fixes(record)
    judge = filtered(record, fixes, _with_filter(settings, "kalman"))
    accepted = fix_claims(truth, fixes, judge.verdicts)
    result.contestants[FIXES].flights.append(FlightScore(accepted, None, None, None, None))
    result.fixes += len(accepted)
    result.outliers += sum(verdict.value == "outlier" for verdict in judge.verdicts.values())
    for name, method in methods.items():
        made = filtered(record, fixes, _with_filter(settings, method))
        result.contestants[name].flights.append(estimate_score(truth, made.estimates, fixes))
    if relocate:
        late = relocated_fixes(record, settings, "latest")
        for method in ("kalman", "none"):
            made = filtered(record, late, _with_filter(settings, method))
            result.contestants[f"{method}, {LATEST}"].flights.append(estimate_score(truth, made.estimates, late))
        if settings.geolocator.height.pad_altitude_amsl_m is not None:
            _compare_ways(record, truth, _with_filter(settings, "kalman"), result)


def _compare_ways(record: FlightRecord, truth: FlightTruth, settings: Settings, result: Comparison) -> None:
    for way in WAYS:
        fixes = relocated_fixes(record, settings, "capture", way)
        made = filtered(record, fixes, settings)
        claims = fix_claims(truth, fixes, made.verdicts)
        result.contestants[f"{FIXES}, {way}"].flights.append(FlightScore(claims, None, None, None, None))
        result.contestants[f"kalman, {way}"].flights.append(estimate_score(truth, made.estimates, fixes))


def _with_filter(settings: Settings, method: FilterSettings | str) -> Settings:
    """The settings with another filter, and no shadows."""
    chosen = settings.filter.model_copy(update={"method": method}) if isinstance(method, str) else method
    return settings.model_copy(update={"filter": chosen.model_copy(update={"shadows": ()})})
