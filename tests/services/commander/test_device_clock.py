"""The time of a component that nobody can ask for it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.runtime.clock import nanoseconds
from services.commander.device_clock import MAX_LATE_NS, DeviceClock

EPOCH_NS = 1_767_225_600_000_000_000
MS = 1_000_000


def errors_ms(delays_ms: list[int], boot_offset_ms: int, period_ms: int = 20) -> list[float]:
    """By how much each message's stamp is later than when it was made."""
    clock, errors = DeviceClock(), []
    for number, delay_ms in enumerate(delays_ms):
        made_ms = number * period_ms
        at_ns = clock.utc_ns((boot_offset_ms + made_ms) * MS, EPOCH_NS + (made_ms + delay_ms) * MS)
        errors.append((at_ns - EPOCH_NS) / MS - made_ms)
    return errors


@pytest.mark.parametrize("boot_offset_ms", [0, 300, 120_000, 4_000_000_000])
def test_it_is_late_by_the_quickest_message_wherever_its_clock_stands(boot_offset_ms: int) -> None:
    assert errors_ms([8, 3, 12, 40, 3, 90], boot_offset_ms) == [8, 3, 3, 3, 3, 3]


def test_it_follows_a_device_that_boots_anew() -> None:
    clock = DeviceClock()
    for boot_ms, now_ms in ((90_000, 0), (90_020, 20), (500, 3_000), (520, 3_020)):
        assert clock.utc_ns(boot_ms * MS, EPOCH_NS + now_ms * MS) == EPOCH_NS + now_ms * MS


def test_one_wild_stamp_costs_no_more_than_itself() -> None:
    clock = DeviceClock()
    for boot_ms, now_ms in ((1_000, 0), (4_294_967_295, 20), (1_040, 40), (1_060, 60)):
        assert clock.utc_ns(boot_ms * MS, EPOCH_NS + now_ms * MS) == EPOCH_NS + now_ms * MS


@given(st.lists(st.tuples(st.integers(0, 2**32 - 1), st.floats(0.0, 5.0)), max_size=60))
def test_whatever_its_clock_does_the_stamp_is_near_the_arrival(reports: list[tuple[int, float]]) -> None:
    """It may stand still, jump, or not be set at all."""
    clock, now_ns = DeviceClock(), EPOCH_NS
    for boot_ms, after_s in reports:
        now_ns += nanoseconds(after_s)
        assert 0 <= now_ns - clock.utc_ns(boot_ms * MS, now_ns) <= MAX_LATE_NS
