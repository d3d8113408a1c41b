# ruff: noqa: T201  (the figures beside PX4's are worth reading: pytest -s)
"""How the simulated vehicle flies, beside what was measured on PX4."""

import math

import pytest
from mavlink_client import Client

from schemas.settings import Settings
from schemas.truth import GroundTruth

LOITER, LAND, RTL, OFFBOARD = 0x03040000, 0x06040000, 0x05040000, 0x00060000
ACCEPTED, TEMPORARILY_REJECTED = 0, 1
STEP_M = 10.0 * math.sqrt(2.0)
SIH_DRAG_N_PER_MPS = 1.0
"""What PX4 was measured with; a real vehicle, and so the default, has less."""


def at(pad_north_m: float, pad_east_m: float, height_m: float, **simulator) -> Settings:
    """A start in the air above the local origin, given from there."""
    airborne = {"north_m": pad_north_m - 5.0, "east_m": pad_east_m - 3.0, "down_m": -height_m}
    return Settings(simulator={"airborne": airborne, "vehicle": {"drag_n_per_mps": SIH_DRAG_N_PER_MPS}, **simulator})


def place(truth: GroundTruth) -> tuple[float, float, float]:
    """North, east, down from home; the pad lies 5 m north and 3 m east of it."""
    north, east, down = truth.vehicle_from_pad_ned_m
    return north + 5.0, east + 3.0, down


class Step:
    """The figures of a 14.1 m step to (10, 10), from the truth."""

    def __init__(self, truths: list[GroundTruth], start_ns: int) -> None:
        rows = []
        for truth in truths:
            north, east, _ = place(truth)
            _, x, y, _ = truth.q_ned_body
            tilt_deg = math.degrees(math.acos(1.0 - 2.0 * (x * x + y * y)))
            away_m = math.hypot(north - 10.0, east - 10.0)
            beyond_m = ((north - 10.0) + (east - 10.0)) / math.sqrt(2.0)
            speed_mps = math.hypot(*truth.velocity_ned_mps[:2])
            rows.append(((truth.at_ns - start_ns) * 1e-9, away_m, beyond_m, speed_mps, tilt_deg))
        self.motion_s = next(row[0] for row in rows if row[1] < STEP_M - 0.1)
        self.speed_mps = max(row[3] for row in rows)
        self.tilt_deg = max(row[4] for row in rows)
        self.within_1m_s = next(row[0] for row in rows if row[1] < 1.0)
        self.within_03m_s = next(row[0] for row in rows if row[1] < 0.3)
        self.overshoot_m = max(row[2] for row in rows)
        self.settled_s = max(row[0] for row in rows if row[1] > 0.2)

    def show(self, name: str, px4: str) -> None:
        print(
            f"{name}: moves after {self.motion_s:.2f} s, {self.speed_mps:.1f} m/s, {self.tilt_deg:.0f} deg, within 1 m {self.within_1m_s:.1f} s, "
            f"0.3 m {self.within_03m_s:.1f} s, overshoot {self.overshoot_m:.2f} m, settled {self.settled_s:.1f} s; PX4: {px4}"
        )


def run_from(client: Client, seconds: float) -> tuple[list[GroundTruth], int]:
    start_ns, mark = client.now_ns, len(client.truths)
    client.run(seconds)
    return client.truths[mark:], start_ns


def test_a_reposition_once_a_second_flies_as_it_does_on_px4():
    client = Client(at(0.0, 0.0, 20.0)).run(2.0)
    altitude_m = client.last("GLOBAL_POSITION_INT").alt * 1e-3
    client.reposition(10.0, 10.0, altitude_m)
    client.every.append((250, lambda: client.reposition(10.0, 10.0, altitude_m)))
    step = Step(*run_from(client, 25.0))
    step.show("reposition", "0.49 s, 3.9 m/s, 31 deg, 6.7 s, 7.7 s, 0.37-0.44 m, 14.6-15.8 s")
    assert step.motion_s == pytest.approx(0.6, abs=0.3)
    assert step.speed_mps == pytest.approx(3.9, abs=0.5)
    assert step.tilt_deg == pytest.approx(31.0, abs=5.0)
    assert step.within_1m_s == pytest.approx(6.7, abs=1.0)
    assert step.within_03m_s == pytest.approx(7.7, abs=1.2)
    assert 0.2 < step.overshoot_m < 0.65
    assert step.settled_s == pytest.approx(15.2, abs=3.0)


def test_offboard_at_20_hz_flies_as_it_does_on_px4():
    client = Client(at(0.0, 0.0, 20.0)).run(2.0)
    altitude_m = client.last("GLOBAL_POSITION_INT").alt * 1e-3
    target = [0.0, 0.0]
    client.every.append((12, lambda: client.offboard_position(*target, altitude_m)))
    client.run(0.5)
    assert client.set_mode(6) == ACCEPTED
    client.run(3.0)
    target[:] = [10.0, 10.0]
    step = Step(*run_from(client, 15.0))
    step.show("offboard", "0.5 s, 6.4 m/s, 45 deg, 3.6 s, 4.2 s, 0.20 m, 7 s")
    assert step.motion_s == pytest.approx(0.5, abs=0.3)
    assert step.speed_mps == pytest.approx(6.4, abs=0.6)
    assert step.tilt_deg == pytest.approx(45.0, abs=4.0)
    assert step.within_1m_s == pytest.approx(3.6, abs=0.6)
    assert step.within_03m_s == pytest.approx(4.2, abs=0.8)
    assert 0.05 < step.overshoot_m < 0.45
    assert step.settled_s == pytest.approx(7.0, abs=2.5)


def test_on_a_descending_ramp_it_lags_as_much_as_px4_does():
    lags = {}
    for offboard in (False, True):
        client = Client(at(0.0, 0.0, 25.0)).run(2.0)
        start_s, top_m = client.time_s, client.last("GLOBAL_POSITION_INT").alt * 1e-3
        wanted_m = lambda client=client, start_s=start_s, top_m=top_m: top_m - 0.7 * (client.time_s - start_s)  # noqa: E731
        if offboard:
            client.every.append((12, lambda client=client, m=wanted_m: client.offboard_position(0.0, 0.0, m())))
            client.run(0.2)
            client.set_mode(6)
        else:
            client.every.append((250, lambda client=client, m=wanted_m: client.reposition(0.0, 0.0, m())))
        client.run(12.0)
        lag = []
        for _ in range(50):
            client.run(0.1)
            lag.append(client.last("GLOBAL_POSITION_INT").alt * 1e-3 - wanted_m())
        lags[offboard] = sum(lag) / len(lag)
    print(
        f"lag on a 0.7 m/s ramp: reposition {lags[False]:.2f} m (PX4 1.66 m), offboard {lags[True]:.2f} m (PX4 0.76 m)"
    )
    assert lags[False] == pytest.approx(1.66, abs=0.6)
    assert lags[True] == pytest.approx(0.76, abs=0.15)


def test_a_takeoff_of_twenty_metres_takes_the_time_it_takes_on_px4():
    client = Client()
    client.until(lambda: client.status == 3, 10)
    armed_s = client.time_s
    client.take_off(20.0)
    speeds = [-truth.velocity_ned_mps[2] for truth in client.truths]
    lift_off_s = next(truth.at_ns for truth in client.truths if not truth.touching_ground) * 1e-9
    states = [(at_s, m.landed_state) for at_s, m in client.log if m.get_type() == "EXTENDED_SYS_STATE"]
    flying_s = next(at_s for at_s, state in states if state == 3)
    start_s = client.truths[0].at_ns * 1e-9
    print(
        f"lift-off {lift_off_s - start_s - armed_s:.1f} s, hold {client.time_s - armed_s:.1f} s after arming, climb {max(speeds):.2f} m/s"
    )
    assert lift_off_s - start_s - armed_s == pytest.approx(3.0, abs=0.6)
    assert flying_s - armed_s == pytest.approx(1.8, abs=0.4)
    assert {state for at_s, state in states if flying_s <= at_s < client.time_s - 1.2} == {3}
    assert client.time_s - armed_s == pytest.approx(18.0, abs=2.5)
    assert max(speeds) == pytest.approx(2.85, abs=0.3)


@pytest.mark.parametrize(("height_m", "seconds", "tolerance_s"), [(3.2, 9.0, 2.0), (10.0, 16.0, 3.0)])
def test_a_landing_takes_its_time_is_detected_and_disarms(height_m, seconds, tolerance_s):
    client = Client(at(5.0, 3.0, height_m)).run(2.0)
    assert client.command(21, 0, 0, 0, math.nan, 0, 0, 0) == ACCEPTED
    landed_s = client.until(lambda: client.last("EXTENDED_SYS_STATE").landed_state == 1, 40)
    disarm_s = client.until(lambda: not client.armed, 5)
    print(f"landing from {height_m} m: {landed_s:.1f} s, disarmed {disarm_s:.1f} s later")
    assert landed_s == pytest.approx(seconds, abs=tolerance_s)
    assert 1.0 < disarm_s < 3.2
    assert client.mode == LOITER
    assert client.truth.touching_ground
    assert math.hypot(*client.truth.vehicle_from_pad_ned_m[:2]) < 0.2
    texts = client.run(0.5).texts()
    assert "Landing at current position" in texts
    assert "Landing detected" in texts
    assert "Disarmed by landing" in texts


def test_a_landing_can_be_broken_off():
    client = Client(at(5.0, 3.0, 8.0)).run(2.0)
    client.command(21)
    client.run(4.0)
    assert client.set_mode(4, 3) == ACCEPTED
    height_m = -client.truth.vehicle_from_pad_ned_m[2]
    client.run(5.0)
    assert client.mode == LOITER
    assert -client.truth.vehicle_from_pad_ned_m[2] == pytest.approx(height_m, abs=0.8)


def test_offboard_needs_a_stream_before_it_is_entered():
    client = Client(at(5.0, 3.0, 15.0)).run(1.5)
    assert client.set_mode(6) == TEMPORARILY_REJECTED
    altitude_m = client.last("GLOBAL_POSITION_INT").alt * 1e-3
    client.every.append((12, lambda: client.offboard_position(5.0, 3.0, altitude_m)))
    client.run(0.3)
    assert client.set_mode(6) == ACCEPTED


@pytest.mark.parametrize(("action", "mode"), [(0, RTL), (5, LOITER), (4, LAND)])
def test_silence_in_offboard_is_a_failsafe_and_setpoints_bring_it_back(action, mode):
    client = Client(at(5.0, 3.0, 15.0, parameters={"COM_OBL_RC_ACT": action})).run(1.5)
    altitude_m = client.last("GLOBAL_POSITION_INT").alt * 1e-3
    stream = (12, lambda: client.offboard_position(5.0, 3.0, altitude_m))
    client.command(511, 436.0, 100_000.0)
    client.every.append(stream)
    client.run(0.5)
    client.set_mode(6)
    client.run(3.0)
    client.every.clear()
    lost_s = client.until(lambda: client.last("CURRENT_MODE").custom_mode == mode, 3)
    assert 0.9 < lost_s < 1.2
    assert client.last("CURRENT_MODE").intended_custom_mode == OFFBOARD
    client.run(1.1)
    assert client.status == 5
    assert "Failsafe activated" in client.texts()
    client.every.append(stream)
    assert client.until(lambda: client.last("CURRENT_MODE").custom_mode == OFFBOARD, 1) < 0.25
    client.run(1.1)
    assert client.status == 4


def test_return_goes_home_and_lands_there():
    client = Client(at(12.0, 3.0, 12.0)).run(1.5)
    assert client.command(20) == ACCEPTED
    client.until(lambda: client.last("EXTENDED_SYS_STATE").landed_state == 4, 40)
    client.until(lambda: not client.armed, 60)
    north_m, east_m, _ = place(client.truth)
    assert math.hypot(north_m, east_m) < 0.5
    assert "RTL: land at destination" in client.texts()


def test_a_silent_ground_station_leads_to_hold_then_return_and_a_command_ends_that():
    client = Client(at(5.0, 3.0, 15.0, parameters={"NAV_DLL_ACT": 2})).run(3.0)
    client.sends_heartbeat = False
    held_s = client.until(lambda: client.status == 5, 20)
    assert held_s == pytest.approx(12.0, abs=1.6)
    assert client.mode == LOITER
    assert client.until(lambda: client.mode == RTL, 10) == pytest.approx(5.0, abs=1.1)
    client.reposition(5.0, 3.0, 505.0)
    client.run(3.0)
    assert client.mode == LOITER
    assert client.status == 4


def test_a_ground_station_that_falls_silent_does_nothing_by_default():
    client = Client(at(5.0, 3.0, 15.0)).run(3.0)
    client.sends_heartbeat = False
    client.run(20.0)
    assert (client.mode, client.status) == (LOITER, 4)


def test_position_setpoints_onto_the_ground_never_disarm_and_a_commanded_descent_does():
    client = Client(at(5.0, 3.0, 3.0)).run(1.5)
    ground_m = client.last("GPS_GLOBAL_ORIGIN").altitude * 1e-3 if client.messages("GPS_GLOBAL_ORIGIN") else 489.6
    client.every.append((12, lambda: client.offboard_position(5.0, 3.0, ground_m - 0.1)))
    client.run(0.3)
    client.set_mode(6)
    client.run(25.0)
    assert client.truth.touching_ground
    assert client.armed
    assert client.last("EXTENDED_SYS_STATE").landed_state == 2
    client.every[:] = [(12, lambda: client.offboard_position(5.0, 3.0, ground_m - 0.1, vz=0.5))]
    client.until(lambda: client.last("EXTENDED_SYS_STATE").landed_state == 1, 8)
    assert client.until(lambda: not client.armed, 4) < 3.2


def test_home_moves_at_arming_and_landing_and_takes_the_relative_altitude_with_it():
    client = Client().take_off(5.0)
    first = client.last("HOME_POSITION")
    client.reposition(6.0, 0.0, client.last("GLOBAL_POSITION_INT").alt * 1e-3)
    client.run(8.0)
    client.command(21)
    client.until(lambda: not client.armed, 60)
    client.run(2.5)
    assert (client.last("HOME_POSITION").latitude - first.latitude) * 1e-7 * 111_170 == pytest.approx(6.0, abs=0.5)


def test_the_estimate_differs_from_the_truth_by_what_the_settings_say():
    client = Client(at(0.0, 0.0, 10.0)).run(2.0)
    errors, yaws = [], []
    for _ in range(600):
        client.run(0.1)
        message = client.last("LOCAL_POSITION_NED")
        truth = min(client.truths[-12:], key=lambda t: abs(t.at_ns - client.now_ns))
        errors.append(message.x - place(truth)[0])
        w, x, y, z = truth.q_ned_body
        yaws.append(
            math.degrees(client.last("ATTITUDE").yaw - math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
        )
    assert 0.003 < max(map(abs, errors)) < 0.12
    assert max(map(abs, yaws)) < 3.0


def test_it_holds_its_place_in_gusty_wind_and_leans_against_it():
    wind = {"north_mps": 3.0, "gust_mps": 0.8}
    client = Client(at(5.0, 3.0, 10.0, wind=wind)).run(15.0)
    mark = len(client.truths)
    client.run(20.0)
    offsets = [math.hypot(*truth.vehicle_from_pad_ned_m[:2]) for truth in client.truths[mark:]]
    pitches = [2.0 * math.asin(truth.q_ned_body[2]) for truth in client.truths[mark:]]
    assert max(offsets) < 1.0
    assert math.degrees(sum(pitches) / len(pitches)) == pytest.approx(17.0, abs=3.0)


def test_a_raised_pad_carries_the_vehicle():
    client = Client(
        Settings(simulator={"pad": {"height_above_home_m": 1.5}, "airborne": {"north_m": 0, "east_m": 0, "down_m": -3}})
    )
    client.run(2.0)
    client.command(21)
    client.until(lambda: not client.armed, 40)
    assert client.truth.vehicle_from_pad_ned_m[2] == pytest.approx(-0.2, abs=1e-6)
    assert client.truth.touching_ground


def test_a_landing_called_at_speed_first_drifts_on_as_it_does_on_px4():
    client = Client(at(0.0, 0.0, 12.0)).run(2.0)
    client.reposition(60.0, 0.0, client.last("GLOBAL_POSITION_INT").alt * 1e-3)
    client.until(lambda: client.truth.velocity_ned_mps[0] > 3.8, 10)
    called_m = place(client.truth)[0]
    client.command(21)
    mark = len(client.truths)
    client.until(lambda: not client.armed, 60)
    drift_m = max(place(truth)[0] for truth in client.truths[mark:]) - called_m
    print(f"landing called at 3.8 m/s: drifts {drift_m:.1f} m (PX4 from 3.9 m/s: 6.7 m)")
    assert 3.0 < drift_m < 9.0
