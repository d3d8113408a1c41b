"""Streams of fixes, for the tests of the filter."""

import numpy as np

from alight.geometry.local import moved_by_ned, ned_between
from alight.geometry.rotation import wrap_pi
from alight.runtime.node import Arrival
from schemas import topics
from schemas.fix import FixVerdict, PadFix, PadPosition
from schemas.message import GlobalPosition, Hop
from schemas.settings import Settings
from services.filter.service import build

T0_NS = 1_767_225_600_000_000_000
PAD = GlobalPosition(latitude_deg=-16.5, longitude_deg=179.9999999, altitude_amsl_m=12.0, ellipsoidal_height_m=68.0)
"""Next to the antimeridian, where averaging degrees would go wrong."""
VEHICLE_NED_M = (3.0, -4.0, -12.0)
HOPS = (Hop(service="camera", received_at_ns=T0_NS, handled_at_ns=T0_NS, published_at_ns=T0_NS),)


def fix(
    time_s, ned_m=(0.0, 0.0, 0.0), azimuth_rad=0.5, sigma_m=0.1, sigma_azimuth_rad=0.03, vehicle=VEHICLE_NED_M, **others
):
    """A fix that puts the pad `ned_m` from PAD, seen from a vehicle at `vehicle`."""
    vehicle_position = moved_by_ned(PAD, vehicle)
    position = moved_by_ned(PAD, ned_m)
    place = PadPosition(
        pad_ned_m=tuple(ned_between(vehicle_position, position).tolist()),
        position=position,
        azimuth_rad=wrap_pi(azimuth_rad),
    )
    fields = {
        "captured_at_ns": T0_NS + round(time_s * 1e9),
        "hops": HOPS,
        "verdict": FixVerdict.ACCEPTED,
        "raw": place,
        "corrected": place,
        "covariance_ned_m2": tuple((sigma_m**2 * np.eye(3)).ravel().tolist()),
        "azimuth_variance_rad2": sigma_azimuth_rad**2,
        "vehicle_position": vehicle_position,
    }
    return PadFix(**(fields | others))


def filter_node(**settings):
    """A node as the service builds it."""
    return build(Settings(filter=settings))


def feed(node, *fixes):
    """Hand it fixes; returns the estimates."""
    estimates = []
    for one in fixes:
        now_ns = one.captured_at_ns + 50_000_000
        estimates += [out.message for out in node.on_message(Arrival(topics.PAD_FIX, one, now_ns, now_ns))]
    return estimates


def ned_of(estimate):
    """Where an estimate puts the pad, from PAD."""
    return ned_between(PAD, estimate.position)
