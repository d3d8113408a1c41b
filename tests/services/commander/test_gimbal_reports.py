"""What a gimbal reports, through the autopilot or for itself: its angles, their time, and what is said when they are not known."""

import math

import pytest
from pymavlink.dialects.v20 import development as mavlink
from scripted_autopilot import START_NS, TICK_NS, ScriptedAutopilot

from alight.geometry.rotation import quaternion_conjugate, quaternion_from_euler, quaternion_multiply
from schemas.message import Quaternion
from schemas.vehicle import UNKNOWN_ROTATION, GimbalState
from services.commander.autopilot_clock import AutopilotClock
from services.commander.gimbal_reports import GimbalReports
from services.commander.node import GIMBAL_PERIOD_NS
from services.commander.vehicle_assembly import VehicleAssembly

AUTOPILOT, GIMBAL = mavlink.MAVLink(None, 1, 1), mavlink.MAVLink(None, 1, mavlink.MAV_COMP_ID_GIMBAL)
LEVEL, DOWN, AHEAD = (quaternion_from_euler(0.0, math.radians(pitch), 0.0) for pitch in (0.0, -90.0, -45.0))
YAW_IN_VEHICLE_FRAME = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
MS = 1_000_000
MOST_AGE_NS = GIMBAL_PERIOD_NS + 2 * TICK_NS
"""Of what was published last, where nothing is under way."""


def report(boot_ms: int, q: Quaternion = AHEAD) -> mavlink.MAVLink_gimbal_device_attitude_status_message:
    return mavlink.MAVLink_gimbal_device_attitude_status_message(0, 0, boot_ms, YAW_IN_VEHICLE_FRAME, q, 0, 0, 0, 0)


def with_gimbal(
    sender: mavlink.MAVLink, boot_offset_ms: int, q: Quaternion = AHEAD, for_s: float = 2.0, **commander: object
) -> ScriptedAutopilot:
    """A vehicle whose gimbal reports fifty times a second."""
    autopilot = ScriptedAutopilot(**commander)
    autopilot.wait(130.0)  # it has run for longer than any of the offsets
    autopilot.gimbals.clear()
    let_report(autopilot, sender, boot_offset_ms, q, for_s)
    return autopilot


def let_report(
    autopilot: ScriptedAutopilot, sender: mavlink.MAVLink, boot_offset_ms: int, q: Quaternion, for_s: float
) -> None:
    for _ in range(round(for_s * 1e9 / TICK_NS)):
        autopilot.forward(sender, report(autopilot.boot_ms + boot_offset_ms, q))
        autopilot.wait(TICK_NS / 1e9)


def complaints(autopilot: ScriptedAutopilot) -> str:
    return "; ".join(text for text in autopilot.node.complaints(autopilot.now_ns) if "gimbal" in text)


@pytest.mark.parametrize("boot_offset_ms", [0, 120_000, -120_000, -300])
def test_a_gimbal_with_a_clock_of_its_own_is_taken_at_the_time_at_which_it_came(boot_offset_ms: int) -> None:
    """It booted two minutes before or after the autopilot, or 0.3 s after it, which looks like the autopilot's own time."""
    autopilot = with_gimbal(GIMBAL, boot_offset_ms)
    newest = autopilot.gimbals[-1]
    assert newest.measured
    assert newest.q_body_gimbal == pytest.approx(AHEAD, abs=1e-6)
    assert 0 <= autopilot.now_ns - newest.at_ns <= MOST_AGE_NS
    assert not any(state.q_body_gimbal == pytest.approx(DOWN) for state in autopilot.gimbals)
    assert complaints(autopilot) == ""


def test_what_the_autopilot_itself_reports_goes_by_the_autopilots_clock() -> None:
    autopilot = with_gimbal(AUTOPILOT, -60)
    assert 60 * MS <= autopilot.now_ns - autopilot.gimbals[-1].at_ns <= 60 * MS + MOST_AGE_NS
    assert autopilot.gimbals[-1].q_body_gimbal == pytest.approx(AHEAD, abs=1e-6)


@pytest.mark.parametrize(
    ("sender", "boot_offset_ms", "q"),
    [(GIMBAL, 0, (0.0, 0.0, 0.0, 0.0)), (GIMBAL, 0, (math.nan,) * 4), (AUTOPILOT, -120_000, AHEAD)],
)
def test_a_gimbal_that_cannot_be_understood_is_never_taken_for_a_fixed_mount(
    sender: mavlink.MAVLink, boot_offset_ms: int, q: Quaternion
) -> None:
    autopilot = with_gimbal(sender, boot_offset_ms, q)
    assert {(state.measured, state.q_body_gimbal) for state in autopilot.gimbals} == {(True, UNKNOWN_ROTATION)}
    assert "no fix of the pad" in complaints(autopilot)
    counters = autopilot.node.counters()
    assert counters["gimbal_reports"] == counters["gimbal_reports_refused"] == 100


def test_a_gimbal_that_falls_silent_is_unknown_until_it_reports_again() -> None:
    autopilot = with_gimbal(GIMBAL, 120_000)
    autopilot.wait(3.0)
    assert autopilot.gimbals[-1].q_body_gimbal == UNKNOWN_ROTATION
    assert autopilot.gimbals[-1].measured
    assert "the gimbal has been silent for 3 s" in complaints(autopilot)
    let_report(autopilot, GIMBAL, 120_000, DOWN, 0.5)
    assert autopilot.gimbals[-1].q_body_gimbal == pytest.approx(DOWN, abs=1e-6)
    assert complaints(autopilot) == ""


def test_a_gimbal_that_boots_anew_is_taken_on() -> None:
    autopilot = with_gimbal(GIMBAL, 0)
    let_report(autopilot, GIMBAL, -130_000, DOWN, 0.5)
    assert autopilot.gimbals[-1].q_body_gimbal == pytest.approx(DOWN, abs=1e-6)
    assert autopilot.now_ns - autopilot.gimbals[-1].at_ns <= MOST_AGE_NS


def test_when_the_autopilot_boots_anew_the_gimbal_is_taken_on() -> None:
    autopilot = with_gimbal(GIMBAL, 0)
    autopilot.reboot()
    autopilot.wait(0.5)
    let_report(autopilot, GIMBAL, 130_000, DOWN, 1.0)
    assert autopilot.gimbals[-1].q_body_gimbal == pytest.approx(DOWN, abs=1e-6)
    assert autopilot.gimbals[-1].measured


def test_without_a_gimbal_the_fixed_mount_is_told() -> None:
    autopilot = ScriptedAutopilot()
    autopilot.wait(1.0)
    assert autopilot.gimbals
    assert all(state.q_body_gimbal == pytest.approx(DOWN) and not state.measured for state in autopilot.gimbals)
    assert complaints(autopilot) == ""


class TurningVehicle:
    """Pitches by one radian a second under a gimbal that looks straight down whatever the vehicle does; 4 ms each way."""

    DELAY_NS = 4 * MS

    def __init__(self) -> None:
        self.clock = AutopilotClock()
        self.assembly = VehicleAssembly(self.clock)
        self.gimbals = GimbalReports((0.0, -90.0, 0.0), self.clock, self.assembly)
        self.booted_ns = START_NS - 50_000 * MS
        for tenth in range(20):
            sent_ns = START_NS + (tenth - 20) * 100 * MS
            boot_ns = sent_ns + self.DELAY_NS - self.booted_ns
            self.clock.take_reply(sent_ns, boot_ns, sent_ns + 2 * self.DELAY_NS)

    def attitude(self, at_ns: int) -> Quaternion:
        return quaternion_from_euler(0.0, (at_ns - START_NS) / 1e9, 0.0)

    def send_attitude(self, made_ns: int) -> None:
        boot_ms = (made_ns - self.booted_ns) // MS
        message = mavlink.MAVLink_attitude_quaternion_message(boot_ms, *self.attitude(made_ns), 0, 1, 0)
        self.assembly.take_attitude(message, made_ns + self.DELAY_NS)
        self.gimbals.join()

    def send_report(self, made_ns: int) -> None:
        message = report((made_ns - START_NS) // MS + 7_777, DOWN)
        message.pack(GIMBAL)
        self.gimbals.take(message, made_ns + self.DELAY_NS)


def test_a_report_waits_for_the_attitude_at_its_time() -> None:
    """It seems to be as new as its arrival, and the attitudes of that time are still under way."""
    vehicle = TurningVehicle()
    published: list[GimbalState] = []
    for made_ms in range(0, 1000, 10):
        made_ns = START_NS + made_ms * MS
        vehicle.send_attitude(made_ns)
        vehicle.send_report(made_ns + 3 * MS)
        published.append(vehicle.gimbals.state(made_ns + 8 * MS))
    assert "gimbal_reports_refused" not in vehicle.gimbals.counters()
    for state in published[2:]:
        expected = quaternion_multiply(quaternion_conjugate(vehicle.attitude(state.at_ns)), DOWN)
        assert state.q_body_gimbal == pytest.approx(expected, abs=1e-3)  # stamps are whole milliseconds


def test_reports_that_no_attitude_ever_comes_for_do_not_fill_the_memory() -> None:
    vehicle = TurningVehicle()
    vehicle.send_attitude(START_NS)
    for made_ms in range(10, 5000, 10):
        vehicle.send_report(START_NS + made_ms * MS)
    counters = vehicle.gimbals.counters()
    assert counters["gimbal_reports"] - counters["gimbal_reports_refused"] <= 64
    assert vehicle.gimbals.state(START_NS + 5000 * MS).q_body_gimbal == UNKNOWN_ROTATION


def test_beside_a_fixed_landing_camera_another_gimbal_is_ignored() -> None:
    autopilot = with_gimbal(GIMBAL, 0, gimbal="ignored")
    assert autopilot.gimbals
    assert not any(state.measured for state in autopilot.gimbals)
    assert all(state.q_body_gimbal == pytest.approx(DOWN) for state in autopilot.gimbals)
