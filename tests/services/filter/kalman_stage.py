"""A vehicle over a pad, whose navigation solution is wrong by a known amount, for the tests of the Kalman filter."""

import numpy as np
from fix_stream import PAD, T0_NS, fix

from alight.geometry.local import moved_by_ned, ned_between
from alight.runtime.node import Arrival
from schemas import topics
from schemas.estimate import PadEstimate
from schemas.fix import PadPosition, SharedErrors
from schemas.fusion import Fusion
from schemas.vehicle import VehicleState

OFF = (0.0, 0.0, 0.0)


def at_ns(time_s):
    return T0_NS + round(time_s * 1e9)


def seen(
    time_s, vehicle_ned_m, navigation_m=OFF, pad_ned_m=OFF, tilt_rad=0.0, tilt_error=OFF, sigma_m=0.02, noise_m=OFF
):
    """A fix: the true vector, seen through an attitude that is off by `tilt_error` (rad, about north, east), where the solution is off
    by `navigation_m`."""
    d = np.subtract(pad_ned_m, vehicle_ned_m)
    vector = d + np.cross(tilt_error, d) + noise_m
    vehicle = np.add(vehicle_ned_m, navigation_m)
    position = moved_by_ned(PAD, vehicle + vector)
    n, e, down = vector.tolist()
    shared = SharedErrors(
        tilt_north_ned_m=(0.0, -tilt_rad * down, tilt_rad * e),
        tilt_east_ned_m=(tilt_rad * down, 0.0, -tilt_rad * n),
        heading_ned_m=OFF, range_ned_m=OFF, principal_x_ned_m=OFF, principal_y_ned_m=OFF, timing_ned_m=OFF, heading_rad=0.01,
    )  # fmt: skip
    place = PadPosition(pad_ned_m=(n, e, down), position=position, azimuth_rad=0.5)
    noise = tuple((sigma_m**2 * np.eye(3)).ravel().tolist())
    return fix(
        time_s,
        raw=place,
        corrected=place,
        vehicle_position=moved_by_ned(PAD, vehicle),
        noise_covariance_ned_m2=noise,
        azimuth_noise_rad2=0.03**2,
        shared=shared,
    )


def state(time_s, vehicle_ned_m, velocity=OFF):
    return VehicleState(
        at_ns=at_ns(time_s),
        position=moved_by_ned(PAD, vehicle_ned_m),
        velocity_ned_mps=velocity,
        q_ned_body=(1.0, 0.0, 0.0, 0.0),
        angular_velocity_body_rps=OFF,
    )


def tell(node, message, later_s=0.05):
    """Hand over a message; gives the estimates and the log that come of it, and at the next tick."""
    topic = topics.VEHICLE_STATE if isinstance(message, VehicleState) else topics.PAD_FIX
    now_ns = message.stamp_ns + round(later_s * 1e9)
    outputs = [*node.on_message(Arrival(topic, message, now_ns, now_ns)), *node.on_tick(now_ns + 1)]
    return (
        [out.message for out in outputs if isinstance(out.message, PadEstimate)],
        [out.message for out in outputs if isinstance(out.message, Fusion)],
    )


def estimates_of(node, messages):
    return [estimate for message in messages for estimate in tell(node, message)[0]]


def verdicts_of(node, messages):
    """Of the active filter, one for each fix."""
    return [
        log.attempts[0].verdict.value for message in messages for log in tell(node, message)[1] if log.captured_at_ns
    ]


def matrix(estimate):
    return np.reshape(estimate.covariance_ned_m2, (3, 3))


def called(estimate):
    """Coordinates of the pad in the navigation solution, from PAD."""
    return ned_between(PAD, estimate.position)
