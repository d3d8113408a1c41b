"""What a fix costs from its arrival at the filter until the estimate is out, by method; side by side in one run."""

import statistics
import time

import numpy as np

from alight.geometry.local import moved_by_ned
from alight.runtime.node import Arrival, Node
from schemas import topics
from schemas.fix import FixVerdict, PadFix, PadPosition, SharedErrors
from schemas.settings import Settings
from services.filter.service import build
from station.bench.hover import PAD, Hover
from station.bench.table import print_table

METHODS = ("none", "mean", "median", "kalman", "moving")
FIXES = 1000
HEIGHT_M = 5.0
SIGMA_M = 0.02
TARGET_MS = 0.15


def bench_estimation() -> None:
    """Feed the same fixes to each method and print."""
    hover = Hover(HEIGHT_M)
    random = np.random.default_rng(0)
    fixes = [_fix(hover, number, random.normal(0.0, SIGMA_M, 3)) for number in range(FIXES)]
    nodes = {method: build(Settings.model_validate({"filter": {"method": method}})) for method in METHODS}
    spent: dict[str, list[float]] = {method: [] for method in METHODS}
    for number, fix in enumerate(fixes):
        for method, node in nodes.items():
            taken_ms = _handled_ms(node, fix, hover, number)
            if taken_ms is not None:
                spent[method].append(taken_ms)
    rows = [
        (method, str(len(values)), f"{statistics.median(values):.3f}", f"{np.percentile(values, 90):.3f}")
        for method, values in spent.items()
    ]
    print_table("Fix in to estimate out, ms, warm", ("method", "estimates", "median", "p90"), rows)
    median = statistics.median(spent["kalman"])
    print(f"kalman {median:.3f} ms (target <= {TARGET_MS}: {'met' if median <= TARGET_MS else 'MISSED'})")


def _handled_ms(node: Node, fix: PadFix, hover: Hover, number: int) -> float | None:
    """Milliseconds until the estimate is out; None if none came. The vehicle's state comes before, the book-keeping after."""
    now_ns = fix.captured_at_ns
    if topics.VEHICLE_STATE in node.subscriptions:
        tuple(node.on_message(Arrival(topics.VEHICLE_STATE, hover.state(number), now_ns, now_ns)))
    arrival = Arrival(topics.PAD_FIX, fix, now_ns, now_ns)
    began_s = time.perf_counter()
    outputs = list(node.on_message(arrival))
    taken_ms = 1e3 * (time.perf_counter() - began_s)
    tuple(node.on_tick(now_ns))
    return taken_ms if outputs else None


def _fix(hover: Hover, number: int, noise_m: np.ndarray) -> PadFix:
    truth = hover.truth(number)
    n, e, d = (noise_m - truth.vehicle_from_pad_ned_m).tolist()
    place = PadPosition(pad_ned_m=(n, e, d), position=moved_by_ned(PAD, noise_m), azimuth_rad=0.0)
    nowhere = (0.0, 0.0, 0.0)
    shared = SharedErrors(
        tilt_north_ned_m=(0.0, -0.005 * d, 0.005 * e),
        tilt_east_ned_m=(0.005 * d, 0.0, -0.005 * n),
        heading_ned_m=(-0.01 * e, 0.01 * n, 0.0),
        range_ned_m=(0.0, 0.0, 0.002 * d),
        principal_x_ned_m=nowhere,
        principal_y_ned_m=nowhere,
        timing_ned_m=nowhere,
        heading_rad=0.01,
    )
    noise_m2 = tuple((SIGMA_M**2 * np.eye(3)).ravel().tolist())
    return PadFix(
        captured_at_ns=truth.at_ns,
        verdict=FixVerdict.ACCEPTED,
        raw=place,
        corrected=place,
        covariance_ned_m2=noise_m2,
        azimuth_variance_rad2=2e-4,
        noise_covariance_ned_m2=noise_m2,
        azimuth_noise_rad2=1e-4,
        shared=shared,
        vehicle_position=truth.vehicle_position,
    )
