"""The series that several pictures draw: paths and heights against the pad, times from the start of the landing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alight.geometry.local import ned_between
from alight.runtime.clock import NS_PER_S
from schemas import topics
from schemas.message import GlobalPosition
from station.flight_record import FlightRecord
from station.metrics.summary import FlightSummary, pad_place

Series = NDArray[np.float64]

_SHOWN_BEFORE_S = 3.0
_SHOWN_AFTER_S = 3.0


@dataclass(frozen=True)
class Path:
    """Positions over time."""

    t_s: Series
    """(N,), seconds since the descent began (or since the record began, if none did)."""
    ned_m: Series
    """(N, 3), from the pad's centre, north, east, down, metres."""

    @property
    def horizontal_m(self) -> Series:
        """(N,), horizontal distance from the pad's centre, metres."""
        return np.asarray(np.hypot(self.ned_m[:, 0], self.ned_m[:, 1]))

    @property
    def height_m(self) -> Series:
        """(N,), height above the pad, metres."""
        return -self.ned_m[:, 2]

    def __bool__(self) -> bool:
        return len(self.t_s) > 0


@dataclass(frozen=True)
class FlightPaths:
    """What was flown, what was believed, what was asked."""

    origin_ns: int
    """Time zero of every picture, UTC ns."""
    shown_s: tuple[float, float]
    """The part of the flight that pictures over time show, seconds."""
    true: Path
    """From the ground truth; empty where there is none."""
    navigated: Path
    """From the autopilot's own position."""
    setpoints: Path
    """The points asked for."""
    descended: bool
    """Whether time zero is the beginning of the descent; otherwise it is the beginning of the record."""

    @property
    def time_label(self) -> str:
        """What the time axes say."""
        return f"time since the {'descent' if self.descended else 'record'} began [s]"


def flight_paths(record: FlightRecord, summary: FlightSummary) -> FlightPaths:
    """Collect the series of one flight; empty where the record has none."""
    part = summary.landing
    starts_ns = [spans.began_at_ns for spans in summary.phases[:1]] + _first_log_ns(record)
    origin_ns = part.began_at_ns if part else min(starts_ns, default=0)
    pad = pad_place(record)
    states = [(state.at_ns, state.position) for state in record.messages(topics.VEHICLE_STATE)]
    asked = [(setpoint.sent_at_ns, setpoint.position) for setpoint in record.messages(topics.SETPOINT)]
    navigated = _path(states, pad, origin_ns)
    return FlightPaths(
        origin_ns=origin_ns,
        shown_s=_shown_s(summary, origin_ns, navigated),
        true=_true_path(record, origin_ns),
        navigated=navigated,
        setpoints=_path(asked, pad, origin_ns),
        descended=part is not None,
    )


def since_s(at_ns: int, origin_ns: int) -> float:
    """A time as seconds since the origin."""
    return (at_ns - origin_ns) / NS_PER_S


def within(path: Path, shown_s: tuple[float, float]) -> Path:
    """The part of a path between two times."""
    chosen = (path.t_s >= shown_s[0]) & (path.t_s <= shown_s[1])
    return Path(path.t_s[chosen], path.ned_m[chosen])


def _first_log_ns(record: FlightRecord) -> list[int]:
    return [logged.logged_at_ns for logged in record.logged(topics.VEHICLE_STATE)[:1]]


def _shown_s(summary: FlightSummary, origin_ns: int, navigated: Path) -> tuple[float, float]:
    part = summary.landing
    if part is None:
        return (float(navigated.t_s[0]), float(navigated.t_s[-1])) if navigated else (0.0, 1.0)
    begin_s = since_s(part.looking_since_ns, origin_ns)
    end_s = since_s(part.ended_at_ns, origin_ns) + _SHOWN_AFTER_S
    return (max(begin_s, -_SHOWN_BEFORE_S), min(end_s, float(navigated.t_s[-1])) if navigated else end_s)


def _true_path(record: FlightRecord, origin_ns: int) -> Path:
    truths = record.messages(topics.GROUND_TRUTH)
    t_s = np.array([since_s(truth.at_ns, origin_ns) for truth in truths], float)
    return Path(t_s, np.array([truth.vehicle_from_pad_ned_m for truth in truths], float).reshape(-1, 3))


def _path(points: list[tuple[int, GlobalPosition]], pad: GlobalPosition | None, origin_ns: int) -> Path:
    if pad is None:
        return Path(np.zeros(0), np.zeros((0, 3)))
    t_s = np.array([since_s(at_ns, origin_ns) for at_ns, _ in points], float)
    return Path(t_s, np.array([ned_between(pad, position) for _, position in points], float).reshape(-1, 3))
