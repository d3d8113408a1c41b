"""What the services' health says of clocks, by host, as a person reads it."""

from collections.abc import Iterable, Iterator

from schemas.health import ClockHealth, Health

AUTOPILOT = "autopilot"


def clock_lines(reports: Iterable[Health]) -> Iterator[str]:
    """One line for the autopilot, one for each host (its largest offset seen by anybody), one for those that never answered."""
    by_host: dict[str, list[tuple[str, ClockHealth]]] = {}
    silent: dict[str, set[str]] = {}
    for report in reports:
        for clock in report.clocks:
            if clock.of == AUTOPILOT:
                yield f"{AUTOPILOT}: {_autopilot(clock)}"
            elif clock.offset_s is None:
                silent.setdefault(clock.of, set()).add(report.service)
            else:
                by_host.setdefault(clock.host, []).append((report.service, clock))
    for host, seen in sorted(by_host.items()):
        asker, worst = max(seen, key=lambda one: abs(one[1].offset_s or 0.0))
        services = ", ".join(sorted({clock.of for _, clock in seen}))
        yield f"host {host} ({services}): {_offset(worst)} against {asker}"
    answered = {clock.of for seen in by_host.values() for _, clock in seen}
    missing = sorted(set(silent) - answered)
    if missing:
        yield f"not known of {', '.join(missing)}: no answer"


def _offset(clock: ClockHealth) -> str:
    assert clock.offset_s is not None
    return f"{1e3 * clock.offset_s:+.2f} ms, {_uncertain(clock)}"


def _autopilot(clock: ClockHealth) -> str:
    if clock.age_s is None:
        return f"{_uncertain(clock)}, TIMESYNC is not answered"
    drift = "not yet known" if clock.drift_ppm is None else f"{clock.drift_ppm:+.0f} ppm"
    return f"{_uncertain(clock)}, drift {drift}"


def _uncertain(clock: ClockHealth) -> str:
    jitter = "" if clock.jitter_s is None else f", jitter {1e3 * clock.jitter_s:.2f} ms"
    return f"uncertain by {1e3 * (clock.uncertainty_s or 0.0):.2f} ms{jitter}"
