"""The noise of the vehicle's position, learnt from the fixes: near the ground it decides what is too far off to be the pad."""

import numpy as np
from fix_stream import filter_node
from hypothesis import given, settings
from hypothesis import strategies as st
from kalman_stage import seen, verdicts_of

from services.filter.quick_noise import QuickNoise

SAID_M = 0.01
HOVER = (0.2, -0.1, -0.8)
RATE_S = 1.0 / 30.0


def learnt_m(random, real_m, other_m, fixes=200):
    """What is learnt from innovations of which `other_m` is expected besides, honestly."""
    noise = QuickNoise(SAID_M**2)
    for _ in range(fixes):
        away = random.normal(0.0, np.hypot(real_m, other_m), 3)
        noise = noise.after(tuple(away), (other_m**2 + noise.variance_m2,) * 3)
    return np.sqrt(noise.variance_m2)


@given(st.integers(0, 2**32 - 1), st.floats(0.35, 0.95), st.floats(0.0, 0.3))
@settings(max_examples=30, deadline=None)
def test_what_the_fixes_show_is_learnt(seed, part, other):
    real_m = part * SAID_M
    assert abs(learnt_m(np.random.default_rng(seed), real_m, other * SAID_M) / real_m - 1.0) < 0.25


@given(st.integers(0, 2**32 - 1), st.floats(5.0, 50.0))
@settings(max_examples=30, deadline=None)
def test_fixes_from_afar_show_nothing_of_it(seed, other):
    assert learnt_m(np.random.default_rng(seed), 0.3 * SAID_M, other * SAID_M) > 0.6 * SAID_M


def test_it_is_never_more_than_the_settings_say_nor_nothing():
    random = np.random.default_rng(2)
    assert learnt_m(random, 5.0 * SAID_M, 0.0) == SAID_M
    assert 0.25 * SAID_M < learnt_m(random, 0.0, 0.1 * SAID_M) < 0.35 * SAID_M
    assert QuickNoise(0.0).after((0.1, 0.1, 0.1), (1e-6,) * 3).variance_m2 == 0.0


def test_one_gross_outlier_does_not_open_the_gate_to_the_next():
    noise = QuickNoise(SAID_M**2)
    for _ in range(200):
        noise = noise.after((0.004, -0.004, 0.004), (noise.variance_m2 + 0.001**2,) * 3)
    once = noise.after((3.0, -3.0, 3.0), (noise.variance_m2 + 0.001**2,) * 3)
    assert 1.0 < once.variance_m2 / noise.variance_m2 < 1.2


def near_the_ground(random, count, noise_m, start_s=0.0):
    """Fixes from 0.8 m, good to two millimetres, by a vehicle whose position has this noise."""
    return [
        seen(start_s + i * RATE_S, HOVER, random.normal(0.0, noise_m, 3), noise_m=random.normal(0.0, 0.002, 3), sigma_m=0.002)
        for i in range(count)
    ]  # fmt: skip


def kalman():
    return filter_node(method="kalman", kalman={"position_noise_m": SAID_M})


def test_an_outlier_of_a_few_centimetres_is_refused_once_the_position_has_shown_how_steady_it_is():
    random, off = np.random.default_rng(3), (0.03, 0.025, 0.0)
    young, grown = kalman(), kalman()
    assert verdicts_of(young, near_the_ground(random, 4, 0.004))[-1] == "fused"
    assert verdicts_of(young, [seen(4 * RATE_S, HOVER, noise_m=off, sigma_m=0.002)]) == ["fused"]
    assert verdicts_of(grown, near_the_ground(random, 100, 0.004))[-1] == "fused"
    assert verdicts_of(grown, [seen(100 * RATE_S, HOVER, noise_m=off, sigma_m=0.002)]) == ["outlier"]


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_a_calm_position_that_becomes_as_noisy_as_the_settings_say_is_soon_followed_again(seed):
    random, node = np.random.default_rng(seed), kalman()
    assert verdicts_of(node, near_the_ground(random, 150, 0.003)).count("outlier") == 0
    noisy = verdicts_of(node, near_the_ground(random, 150, SAID_M, 150 * RATE_S))
    assert noisy[:90].count("fused") > 75 and "reinitialised" not in noisy
    assert noisy[90:].count("outlier") <= 6
