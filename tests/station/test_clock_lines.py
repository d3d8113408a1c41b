"""Clocks in the output of `alight status`."""

from schemas.health import ClockHealth, Health
from station.clock_lines import clock_lines


def health(service: str, *clocks: ClockHealth) -> Health:
    return Health(
        at_ns=1, service=service, pid=1, uptime_s=1.0, inputs=(), outputs=(), counters={}, complaints=(), clocks=clocks
    )


def far(of: str, host: str, offset_s: float) -> ClockHealth:
    return ClockHealth(of=of, host=host, offset_s=offset_s, round_trip_s=0.002, uncertainty_s=0.001, age_s=0.1)


def test_hosts_have_a_line_each_with_the_largest_offset_that_anybody_sees() -> None:
    lines = list(
        clock_lines(
            [
                health("geolocator", far("camera", "drone", 0.3), far("commander", "ground", 0.0)),
                health("detector", far("camera", "drone", 0.0), far("filter", "ground", -0.3)),
            ]
        )
    )
    assert lines == [
        "host drone (camera): +300.00 ms, uncertain by 1.00 ms against geolocator",
        "host ground (commander, filter): -300.00 ms, uncertain by 1.00 ms against detector",
    ]


def test_the_autopilots_clock_and_those_that_do_not_answer_are_named() -> None:
    autopilot = ClockHealth(of="autopilot", uncertainty_s=0.0006, jitter_s=0.0001, drift_ppm=-12.0, age_s=0.05)
    lines = list(clock_lines([health("commander", autopilot, ClockHealth(of="filter"))]))
    assert lines == [
        "autopilot: uncertain by 0.60 ms, jitter 0.10 ms, drift -12 ppm",
        "not known of filter: no answer",
    ]
    (before,) = clock_lines([health("commander", ClockHealth(of="autopilot", uncertainty_s=0.05))])
    assert before.endswith("TIMESYNC is not answered")


def test_older_recordings_say_nothing_of_clocks() -> None:
    assert list(clock_lines([health("camera")])) == []
