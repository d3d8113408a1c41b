"""Boot time to UTC by TIMESYNC."""

import numpy as np
import pytest

from alight.runtime.clock import NS_PER_S, nanoseconds
from services.commander.autopilot_clock import ONE_WAY_UNCERTAINTY_S, AutopilotClock

EPOCH = 1_767_225_600 * NS_PER_S
BOOTED = EPOCH - 100 * NS_PER_S


def boot_at(utc_ns: int, drift: float = 0.0, booted_ns: int = BOOTED) -> int:
    return round((utc_ns - booted_ns) * (1.0 + drift))


def exchange(
    clock: AutopilotClock,
    rng: np.random.Generator,
    seconds: float,
    drift: float = 0.0,
    start: int = EPOCH,
    booted_ns: int = BOOTED,
) -> int:
    """Ten replies a second over a link with 0.3-5 ms each way, now and then much more; returns when it ended."""
    now = start
    for _ in range(round(seconds * 10)):
        there, back = (nanoseconds(0.0003 + rng.exponential(0.001)) for _ in range(2))
        if rng.random() < 0.1:
            back += nanoseconds(0.05)
        clock.take_reply(now, boot_at(now + there, drift, booted_ns), now + there + back)
        now += NS_PER_S // 10
    return now


def error_ms(clock: AutopilotClock, utc_ns: int, drift: float = 0.0, booted_ns: int = BOOTED) -> float:
    mapped = clock.utc_ns(boot_at(utc_ns, drift, booted_ns))
    assert mapped is not None
    return (mapped - utc_ns) / 1e6


@pytest.mark.parametrize("drift", [0.0, 50e-6, -0.05])
def test_it_is_right_to_a_millisecond_also_when_the_autopilots_clock_drifts(drift: float) -> None:
    """-0.05: a simulation that does not keep up."""
    clock = AutopilotClock()
    end = exchange(clock, np.random.default_rng(1), 10.0, drift)
    assert abs(error_ms(clock, end, drift)) < 1.0
    assert clock.uncertainty_s < 0.002


def test_before_any_reply_the_quickest_message_bounds_it() -> None:
    clock = AutopilotClock()
    assert clock.utc_ns(1) is None
    for i, delay_ms in enumerate((8, 3, 12)):
        now = EPOCH + i * NS_PER_S // 50
        clock.take_arrival(boot_at(now), now + delay_ms * 1_000_000)
    assert error_ms(clock, EPOCH + NS_PER_S) == pytest.approx(3.0, abs=1e-3)
    assert clock.uncertainty_s == ONE_WAY_UNCERTAINTY_S


@pytest.mark.parametrize("drift", [0.0, 50e-6, -0.05])
def test_the_boot_time_of_a_moment_is_the_inverse(drift: float) -> None:
    clock = AutopilotClock()
    assert clock.boot_ns(EPOCH) is None
    clock.take_arrival(boot_at(EPOCH), EPOCH + 5_000_000)
    assert clock.boot_ns(EPOCH + 5_000_000) == boot_at(EPOCH)
    end = exchange(clock, np.random.default_rng(5), 10.0, drift)
    for before_ns in (0, NS_PER_S // 7, 2 * NS_PER_S):
        boot_ns = boot_at(end - before_ns, drift)
        mapped_ns = clock.utc_ns(boot_ns)
        assert mapped_ns is not None
        assert clock.boot_ns(mapped_ns) == pytest.approx(boot_ns, abs=2)


def test_single_wild_replies_change_nothing() -> None:
    clock = AutopilotClock()
    end = exchange(clock, np.random.default_rng(2), 5.0)
    for _ in range(3):
        clock.take_reply(end, boot_at(end) + 5 * NS_PER_S, end + 1_000_000)
    assert abs(error_ms(clock, end)) < 1.0
    assert clock.restarts == 0


def test_a_clock_that_was_set_anew_is_followed() -> None:
    clock = AutopilotClock()
    end = exchange(clock, np.random.default_rng(3), 5.0)
    elsewhere = BOOTED + 30 * NS_PER_S
    end = exchange(clock, np.random.default_rng(4), 3.0, start=end, booted_ns=elsewhere)
    assert abs(error_ms(clock, end, booted_ns=elsewhere)) < 1.5
    assert clock.restarts == 1


@pytest.mark.parametrize(
    ("sent", "boot", "now"),
    [(EPOCH, 1, EPOCH - 1), (EPOCH, 1, EPOCH + 2 * NS_PER_S), (EPOCH, 0, EPOCH), (EPOCH, -5, EPOCH)],
)
def test_nonsense_is_left_out(sent: int, boot: int, now: int) -> None:
    clock = AutopilotClock()
    clock.take_reply(sent, boot, now)
    assert not clock.synchronised


@pytest.mark.parametrize("drift", [0.0, 80e-6, -80e-6, -0.05])
def test_health_tells_the_drift_once_it_was_watched_for_ten_seconds(drift: float) -> None:
    clock = AutopilotClock()
    end = exchange(clock, np.random.default_rng(5), 8.0, drift)
    assert clock.health(end).drift_ppm is None
    end = exchange(clock, np.random.default_rng(6), 60.0, drift, start=end)
    assert clock.health(end).drift_ppm == pytest.approx(1e6 * drift, abs=30.0)


def test_health_tells_jitter_round_trip_and_what_was_left_out() -> None:
    clock = AutopilotClock()
    end = exchange(clock, np.random.default_rng(7), 5.0)
    for _ in range(3):
        clock.take_reply(end, boot_at(end) + 5 * NS_PER_S, end + 1_000_000)
    clock.take_reply(end, -1, end)
    health = clock.health(end + NS_PER_S)
    assert health.answers == 50 and health.outliers == 4
    assert health.jitter_s is not None and 1e-5 < health.jitter_s < 2e-3
    assert health.round_trip_s is not None and 0.0006 < health.round_trip_s < 0.002
    assert health.age_s == pytest.approx(1.0, abs=0.2) and health.offset_s is None


def test_what_is_wrong_with_the_clock_has_words() -> None:
    clock = AutopilotClock()
    assert "not answered" in clock.complaints(EPOCH)[0]
    end = exchange(clock, np.random.default_rng(8), 20.0)
    assert clock.complaints(end) == ()
    (silent,) = clock.complaints(end + 7 * NS_PER_S)
    assert silent == "TIMESYNC has not been answered for 7 s"
    slow = AutopilotClock()
    (found,) = slow.complaints(exchange(slow, np.random.default_rng(9), 20.0, -0.05))
    assert "5.0 % slow" in found


def test_a_link_that_takes_long_makes_the_time_uncertain_and_says_so() -> None:
    clock = AutopilotClock()
    for number in range(30):
        now = EPOCH + number * NS_PER_S // 10
        clock.take_reply(now, boot_at(now + nanoseconds(0.04)), now + nanoseconds(0.08))
    (found,) = clock.complaints(EPOCH + 3 * NS_PER_S)
    assert "uncertain by 40 ms" in found
