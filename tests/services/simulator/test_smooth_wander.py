"""A wander that drifts instead of jittering."""

import numpy as np
import pytest

from services.simulator.noise import GaussMarkov, Normals, SmoothGaussMarkov

STEP_S = 0.1


def walks(make, count=400, steps=600):
    rows = []
    for seed in range(count):
        process = make(Normals(np.random.default_rng(seed)))
        row = [process.value]
        for _ in range(steps):
            process.advance()
            row.append(process.value)
        rows.append(row)
    return np.array(rows)


def test_it_is_as_large_as_asked_for_from_the_first_sample_and_changes_by_a_metre_a_minute():
    values = walks(lambda normals: SmoothGaussMarkov(normals, 0.92, 30.0, 30.0, STEP_S))
    # 400 samples know a standard deviation to 3.5 %.
    assert values[:, 0].std() == pytest.approx(0.92, rel=0.14)
    assert values[:, -1].std() == pytest.approx(0.92, rel=0.14)
    assert (values[:, 600] - values[:, 0]).std() == pytest.approx(1.0, rel=0.14)


def test_it_has_a_velocity_where_the_plain_process_has_none():
    smooth = walks(lambda normals: SmoothGaussMarkov(normals, 0.92, 30.0, 30.0, STEP_S), 50)
    rough = walks(lambda normals: GaussMarkov(normals, 0.92, 30.0, STEP_S), 50)
    assert np.abs(np.diff(smooth)).max() / STEP_S < 0.2
    assert np.diff(smooth).std() / STEP_S == pytest.approx(0.92 / 30.0, rel=0.2)
    assert np.abs(np.diff(rough)).max() / STEP_S > 2.0
