"""Which SET_POSITION_TARGET messages the simulated autopilot flies, and which it drops without a word, as PX4 does."""

import math

import pytest
from mavlink_client import Client
from pymavlink.dialects.v20 import development as mavlink

from schemas.settings import Settings

POSITION, POSITION_YAW, POSITION_VZ, VELOCITY = 0xDF8, 0x9F8, 0xDD8, 0xDC7
NAN = math.nan


@pytest.fixture
def flying() -> Client:
    """Hovering 15 m above the pad, 5 m north and 3 m east of the origin."""
    return Client(Settings(simulator={"airborne": {"north_m": 0.0, "east_m": 0.0, "down_m": -15.0}})).run(1.5)


class Global:
    """A global setpoint, to be sent again and again."""

    def __init__(self, client: Client, frame: int, mask: int, **fields: float) -> None:
        x, y = client.degrees_1e7(5.0, 3.0)
        values = {"lat": x, "lon": y, "alt": 504.4, "vx": 0.0, "vy": 0.0, "vz": 0.0, "yaw": 0.0} | fields
        self.message = mavlink.MAVLink_set_position_target_global_int_message(
            0, 1, 1, frame, mask, int(values["lat"]), int(values["lon"]), values["alt"], values["vx"], values["vy"], values["vz"], 0, 0, 0, values["yaw"], 0,
        )  # fmt: skip
        client.every[:] = [(12, lambda: client.send(self.message))]


def accepted(client: Client) -> bool:
    client.run(0.5)
    return client.set_mode(6) == 0


@pytest.mark.parametrize("frame", [5, 6, 11])
def test_three_global_frames_are_taken(flying, frame):
    Global(flying, frame, POSITION)
    assert accepted(flying)


@pytest.mark.parametrize("frame", [0, 1, 3, 7, 10, 13])
def test_other_global_frames_are_dropped(flying, frame):
    Global(flying, frame, POSITION)
    assert not accepted(flying)
    Global(flying, frame, VELOCITY)
    assert not accepted(flying)
    assert flying.node.counters()["dropped_setpoints"] > 0


def test_a_position_with_an_axis_ignored_is_no_position(flying):
    for bit in (1, 2, 4):
        Global(flying, 5, POSITION | bit)
        assert not accepted(flying)


@pytest.mark.parametrize(
    "fields", [{"alt": NAN}, {"alt": math.inf}, {"lat": 2_000_000_000}, {"lon": 2_000_000_000}, {"alt": 1e30}]
)
def test_a_position_that_is_none_is_dropped(flying, fields):
    Global(flying, 5, POSITION, **fields)
    assert not accepted(flying)


def test_the_amsl_altitude_is_flown(flying):
    Global(flying, 5, POSITION, alt=500.0)
    assert accepted(flying)
    flying.run(10.0)
    assert flying.last("GLOBAL_POSITION_INT").alt * 1e-3 == pytest.approx(500.0, abs=0.15)


def test_a_yaw_is_flown_only_if_the_mask_says_so(flying):
    Global(flying, 5, POSITION, yaw=1.5)
    assert accepted(flying)
    flying.run(4.0)
    assert abs(flying.last("ATTITUDE").yaw) < 0.15
    Global(flying, 5, POSITION_YAW, yaw=1.5)
    flying.run(5.0)
    assert flying.last("ATTITUDE").yaw == pytest.approx(1.5, abs=0.1)


def test_a_vertical_speed_is_fed_forward_onto_the_position(flying):
    here_m = flying.last("GLOBAL_POSITION_INT").alt * 1e-3
    Global(flying, 5, POSITION_VZ, alt=here_m, vz=0.5)
    assert accepted(flying)
    flying.run(8.0)
    # Position gain 1 per second: 0.5 m/s settle 0.5 m below the position.
    assert flying.last("GLOBAL_POSITION_INT").alt * 1e-3 - here_m == pytest.approx(-0.5, abs=0.12)


def test_a_velocity_is_flown_without_a_position(flying):
    Global(flying, 5, VELOCITY, vx=2.0)
    assert accepted(flying)
    # The integral of the velocity loop takes up the air's drag with a time constant of 7 s.
    flying.run(20.0)
    velocity = flying.truth.velocity_ned_mps
    assert velocity == pytest.approx((2.0, 0.0, 0.0), abs=0.25)
    target = flying.last("POSITION_TARGET_LOCAL_NED")
    assert math.isnan(target.x)
    assert target.vx == pytest.approx(2.0)


def test_local_positions_are_north_east_down_from_the_origin(flying):
    message = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, POSITION, 8.0, 3.0, -14.0, *[0] * 8)
    flying.every[:] = [(12, lambda: flying.send(message))]
    assert accepted(flying)
    flying.run(8.0)
    here = flying.last("LOCAL_POSITION_NED")
    assert (here.x, here.y, here.z) == pytest.approx((8.0, 3.0, -14.0), abs=0.25)


def test_body_velocities_turn_with_the_nose(flying):
    flying.reposition(5.0, 3.0, 504.4, yaw=math.pi / 2)
    flying.run(8.0)
    message = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 8, VELOCITY, 0, 0, 0, 2.0, 0, 0, *[0] * 5)
    flying.every[:] = [(12, lambda: flying.send(message))]
    assert accepted(flying)
    flying.run(20.0)
    assert flying.truth.velocity_ned_mps == pytest.approx((0.0, 2.0, 0.0), abs=0.3)


def test_setpoints_for_another_vehicle_are_not_ours(flying):
    x, y = flying.degrees_1e7(5.0, 3.0)
    message = mavlink.MAVLink_set_position_target_global_int_message(0, 2, 1, 5, POSITION, x, y, 504.4, *[0] * 8)
    flying.every[:] = [(12, lambda: flying.send(message))]
    assert not accepted(flying)
