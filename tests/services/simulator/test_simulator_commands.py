"""How the simulated autopilot answers, seen from outside: every expectation is a line of what was measured on PX4."""

import math

import pytest
from mavlink_client import Client
from pymavlink.dialects.v20 import development as mavlink

from schemas.settings import Settings

NAN = math.nan
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)
LOITER, TAKEOFF, LAND, RTL, OFFBOARD = 0x03040000, 0x02040000, 0x06040000, 0x05040000, 0x00060000
AIRBORNE = Settings(simulator={"airborne": {"north_m": 0.0, "east_m": 0.0, "down_m": -15.0}})


@pytest.fixture
def ready() -> Client:
    client = Client()
    client.until(lambda: client.status == 3, 10)
    return client


@pytest.fixture
def flying() -> Client:
    return Client(AIRBORNE).run(1.5)


def test_the_readiness_after_boot_comes_in_px4s_order():
    client = Client().run(7.0)
    first = {}
    for at_s, message in client.log:
        first.setdefault(message.get_type(), at_s)
        if message.get_type() == "HEARTBEAT" and message.system_status == 3:
            first.setdefault("standby", at_s)
        if message.get_type() == "SYS_STATUS" and message.onboard_control_sensors_health & 0x10000000:
            first.setdefault("prearm", at_s)
    assert first["HEARTBEAT"] == pytest.approx(2.0, abs=0.3)
    assert 2.9 < first["HOME_POSITION"] < 5.2
    assert first["GLOBAL_POSITION_INT"] == pytest.approx(3.4, abs=0.2)
    assert 4.9 < first["standby"] < 6.1
    assert 4.9 < first["prearm"] < 6.1
    assert client.messages("HEARTBEAT")[0].system_status == 0


def test_arming_too_early_is_rejected_and_the_reason_is_said():
    client = Client().run(2.5)
    assert client.arm() == TEMPORARILY_REJECTED
    client.run(2.0)
    assert client.arm() == ACCEPTED
    client.run(1.0)
    assert "Arming denied" in client.texts()


@pytest.mark.parametrize(("main", "sub"), [(4, 6), (4, 5), (4, 9), (4, 4), (3, 0), (6, 0)])
def test_on_the_ground_any_mode_is_accepted_but_not_every_mode_arms(ready, main, sub):
    assert ready.set_mode(main, sub) == ACCEPTED
    ready.run(1.1)
    assert ready.mode == (main << 16 | sub << 24)
    assert ready.status == 0
    assert ready.arm() == TEMPORARILY_REJECTED


def test_a_mode_that_does_not_exist_is_rejected(ready):
    assert ready.set_mode(42) == TEMPORARILY_REJECTED
    assert ready.command(176, 0.0, 4.0, 3.0) == TEMPORARILY_REJECTED
    assert ready.command(176, NAN, 4.0, 3.0) == TEMPORARILY_REJECTED


def test_nobody_answers_what_is_not_for_it(ready):
    assert ready.command(400, 2.0) is None
    assert ready.command(400, 1.0, target=(2, 1)) is None
    assert ready.command(400, 1.0, target=(1, 154)) is None
    assert ready.command(400, 1.0, system=1, component=1) is None
    assert ready.command(1000, 0.0) is None
    assert not ready.armed


@pytest.mark.parametrize("number", [252, 193, 31, 17, 410, 65000])
def test_unknown_commands_are_unsupported(ready, number):
    assert ready.command(number) == UNSUPPORTED


def test_unsupported_parameters_are_denied(flying):
    assert flying.command(21, 0, 0, 9.0, NAN) == DENIED
    assert flying.command(22, 0, 5.0, 0, NAN, 0, 0, 501.0) == DENIED


def test_an_acknowledgement_names_the_one_who_asked(ready):
    ready.arm()
    ack = ready.last("COMMAND_ACK")
    assert (ack.target_system, ack.target_component) == (245, 191)


def test_armed_and_idle_it_disarms_after_ten_seconds(ready):
    assert ready.arm() == ACCEPTED
    ready.run(1.2)
    assert ready.armed
    assert 8.5 < ready.until(lambda: not ready.armed, 15) < 11.5
    assert "auto preflight disarming" in ready.run(0.5).texts()


def test_a_takeoff_to_a_relative_altitude_is_accepted_and_never_lifts(ready):
    assert ready.arm() == ACCEPTED
    assert ready.command(22, NAN, NAN, NAN, NAN, NAN, NAN, 10.0) == ACCEPTED
    ready.until(lambda: ready.armed, 2)
    ready.until(lambda: not ready.armed, 15)
    assert ready.truth.touching_ground


def test_a_takeoff_without_altitude_climbs_two_and_a_half_metres(ready):
    ready.arm()
    assert ready.command(22, NAN, NAN, NAN, NAN, NAN, NAN, NAN) == ACCEPTED
    ready.until(lambda: ready.mode == LOITER and ready.time_s > 12, 30)
    ready.run(4.0)
    assert -ready.last("LOCAL_POSITION_NED").z == pytest.approx(2.5, abs=0.25)
    assert "Using default takeoff altitude: 2.5 m" in ready.texts()


def test_in_the_air_it_does_not_disarm_unless_forced(flying):
    assert flying.command(400, 0.0) == TEMPORARILY_REJECTED
    assert flying.command(400, 0.0, 21196.0) == ACCEPTED
    flying.run(1.1)
    assert not flying.armed


@pytest.mark.parametrize(("main", "sub"), [(6, 0), (3, 0), (4, 4), (4, 9), (1, 0)])
def test_in_the_air_a_mode_that_cannot_be_flown_is_rejected(flying, main, sub):
    assert flying.set_mode(main, sub) == TEMPORARILY_REJECTED
    flying.run(1.1)
    assert flying.mode == LOITER


def test_a_pilot_with_sticks_takes_the_vehicle_over_and_flies_it(flying):
    flying.every.append(
        (10, lambda: flying.send(mavlink.MAVLink_manual_control_message(1, 500, 0, 500, 0, 0), system=255))
    )
    flying.run(0.2)
    assert flying.set_mode(3, system=255) == ACCEPTED
    flying.run(3.0)
    assert flying.mode == 0x00030000
    assert math.hypot(*flying.truth.velocity_ned_mps[:2]) > 1.0
    flying.every.clear()
    flying.until(lambda: flying.mode == RTL and flying.status == 5, 3)


def test_another_ground_station_changes_the_mode_of_an_offboard_flight(flying):
    home_m = flying.last("GLOBAL_POSITION_INT").alt * 1e-3
    flying.every.append((12, lambda: flying.offboard_position(5.0, 3.0, home_m)))
    flying.run(0.5)
    assert flying.set_mode(6) == ACCEPTED
    flying.run(1.1)
    assert flying.mode == OFFBOARD
    assert flying.set_mode(4, 3, system=255, component=190) == ACCEPTED
    flying.run(1.1)
    assert flying.mode == LOITER
    assert flying.last("CURRENT_MODE") is not None


def test_a_reposition_outside_hold_needs_the_flag_that_changes_the_mode(flying):
    assert flying.command(21) == ACCEPTED
    flying.run(1.0)
    x, y = flying.degrees_1e7(5.0, 3.0)
    assert flying.command_int(192, [-1.0, 0.0, 0.0, NAN], x, y, 503.0) == DENIED
    assert flying.command_int(192, [-1.0, 1.0, 0.0, NAN], x, y, 503.0) == ACCEPTED
    flying.run(1.1)
    assert flying.mode == LOITER


def test_a_reposition_on_the_ground_is_accepted_without_effect(ready):
    assert ready.reposition(5.0, 5.0, 500.0) == ACCEPTED
    ready.run(2.0)
    assert ready.truth.touching_ground


@pytest.mark.parametrize("frame", [0, 3, 5, 6])
def test_a_reposition_takes_its_altitude_as_amsl_whatever_the_frame(flying, frame):
    here = flying.last("GLOBAL_POSITION_INT")
    assert (
        flying.command_int(192, [-1.0, 1.0, 0.0, NAN], here.lat, here.lon, here.alt * 1e-3 - 2.0, frame=frame)
        == ACCEPTED
    )
    flying.run(8.0)
    assert flying.last("GLOBAL_POSITION_INT").alt - here.alt == pytest.approx(-2000, abs=150)


def test_a_reposition_without_a_place_keeps_the_place(flying):
    here = flying.last("GLOBAL_POSITION_INT")
    nowhere = 2**31 - 1
    assert flying.command_int(192, [-1.0, 1.0, 0.0, NAN], nowhere, nowhere, here.alt * 1e-3 + 1.0) == ACCEPTED
    assert flying.command_int(192, [-1.0, 1.0, 0.0, NAN], 2_000_000_000, here.lon, here.alt * 1e-3 + 1.0) == ACCEPTED
    flying.run(6.0)
    assert abs(flying.last("GLOBAL_POSITION_INT").lat - here.lat) < 30
    assert flying.last("GLOBAL_POSITION_INT").alt - here.alt == pytest.approx(1000, abs=150)


def test_without_a_yaw_the_nose_turns_only_to_a_target_further_than_ten_metres(flying):
    flying.reposition(5.0, 9.0, 503.0)
    flying.run(6.0)
    assert abs(math.degrees(flying.last("ATTITUDE").yaw)) < 8.0
    flying.reposition(5.0, 23.0, 503.0)
    flying.run(8.0)
    assert math.degrees(flying.last("ATTITUDE").yaw) == pytest.approx(90.0, abs=8.0)
    flying.reposition(5.0, 23.0, 503.0, yaw=0.0)
    flying.run(8.0)
    assert abs(math.degrees(flying.last("ATTITUDE").yaw)) < 8.0


def test_nonsense_in_place_of_numbers_changes_nothing(flying):
    before = flying.truth.vehicle_from_pad_ned_m
    inf = math.inf
    for number in (22, 21, 192, 178, 186, 511, 512, 176, 179, 400):
        for value in (NAN, inf, -inf, 1e30):
            if number in (21, 22, 400, 192, 186):
                continue
            flying.command(number, value, value, value, value, value, value, value)
    flying.command_int(192, [NAN, 1.0, NAN, NAN], 2**31 - 1, 2**31 - 1, NAN)
    flying.run(3.0)
    assert flying.armed
    assert flying.truth.vehicle_from_pad_ned_m == pytest.approx(before, abs=0.3)
