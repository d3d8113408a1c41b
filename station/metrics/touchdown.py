"""Where the vehicle really came down."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from alight.runtime.clock import seconds
from schemas.message import Vector3
from schemas.truth import GroundTruth
from station.metrics.paper import path_length_m
from station.metrics.phases import LandingPart


@dataclass(frozen=True)
class Touchdown:
    """The first contact after the descent began, and where it came to rest; from the ground truth."""

    at_ns: int
    """First sample that touches the ground, UTC ns."""
    after_s: float
    """Since the descent began, seconds."""
    contact_ned_m: Vector3
    """From the pad's centre to the vehicle at the first contact, north, east, down, metres."""
    rest_ned_m: Vector3
    """The same at the end of the record."""
    sink_rate_mps: float
    """Downward speed just before the contact, m/s."""
    distance_flown_m: float
    """True length of the path from the beginning of the descent to the contact, metres."""

    @property
    def error_m(self) -> float:
        """Horizontal distance from the pad's centre at the first contact, metres."""
        return math.hypot(*self.contact_ned_m[:2])

    @property
    def rest_error_m(self) -> float:
        """The same at rest, metres."""
        return math.hypot(*self.rest_ned_m[:2])


def touchdown(truths: Sequence[GroundTruth], part: LandingPart) -> Touchdown | None:
    """Find the touchdown; None if the vehicle never touched the ground after the descent began, or there is no truth."""
    descent = [truth for truth in truths if truth.at_ns >= part.began_at_ns]
    index = next((index for index, truth in enumerate(descent) if truth.touching_ground), None)
    if index is None:
        return None
    contact, before = descent[index], descent[max(0, index - 1)]
    path_m = np.array([truth.vehicle_from_pad_ned_m for truth in descent[: index + 1]], float)
    return Touchdown(
        at_ns=contact.at_ns,
        after_s=seconds(contact.at_ns - part.began_at_ns),
        contact_ned_m=contact.vehicle_from_pad_ned_m,
        rest_ned_m=descent[-1].vehicle_from_pad_ned_m,
        sink_rate_mps=before.velocity_ned_mps[2],
        distance_flown_m=path_length_m(path_m),
    )
