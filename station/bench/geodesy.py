"""How many points a second are turned between geodetic and earth-centred coordinates, on one core."""

import statistics
import time
from collections.abc import Callable

import numpy as np

from alight.geometry.geodesy import ecef_from_geodetic, ecef_of_point, geodetic_from_ecef, geodetic_of_point
from station.bench.table import print_table

POINTS = 1_000_000
SINGLE_POINTS = 20_000
REPETITIONS = 5
TARGET_PER_S = 1e6


def bench_geodesy() -> None:
    """Convert points from all over the globe as arrays and one by one, and print."""
    random = np.random.default_rng(0)
    latitudes_deg = np.degrees(np.arcsin(random.uniform(-1.0, 1.0, POINTS)))
    longitudes_deg, heights_m = random.uniform(-180.0, 180.0, POINTS), random.uniform(-100.0, 10_000.0, POINTS)
    ecef_m = ecef_from_geodetic(latitudes_deg, longitudes_deg, heights_m)
    rates = {
        "geodetic to ECEF, arrays": _per_s(
            POINTS, lambda: ecef_from_geodetic(latitudes_deg, longitudes_deg, heights_m)
        ),
        "ECEF to geodetic (Zhu), arrays": _per_s(POINTS, lambda: geodetic_from_ecef(ecef_m)),
        "geodetic to ECEF, one by one": _one_by_one(ecef_of_point, (latitudes_deg, longitudes_deg, heights_m)),
        "ECEF to geodetic, one by one": _one_by_one(geodetic_of_point, tuple(ecef_m.T)),
    }
    rows = [(name, f"{rate / 1e6:.2f}") for name, rate in rates.items()]
    print_table("Geodesy, millions of points a second, median of five", ("", "Mpoints/s"), rows)
    slowest = min(rate for name, rate in rates.items() if name.endswith("arrays"))
    met = "met" if slowest >= TARGET_PER_S else "MISSED"
    print(f"arrays: {slowest / 1e6:.2f} million points a second at least (target >= {TARGET_PER_S / 1e6:g}: {met})")


def _one_by_one(convert: Callable[[float, float, float], object], columns: tuple[np.ndarray, ...]) -> float:
    points = np.column_stack([column[:SINGLE_POINTS] for column in columns]).tolist()
    return _per_s(SINGLE_POINTS, lambda: [convert(*point) for point in points])


def _per_s(count: int, convert: Callable[[], object]) -> float:
    spent_s = []
    for _ in range(REPETITIONS):
        began_s = time.perf_counter()
        convert()
        spent_s.append(time.perf_counter() - began_s)
    return count / statistics.median(spent_s)
