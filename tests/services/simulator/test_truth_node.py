"""The ground truth of a PX4 simulation that runs elsewhere."""

import math

import pytest
from pymavlink.dialects.v20 import development as mavlink

from alight.runtime.clock import LOCKSTEP_EPOCH_NS
from alight.runtime.node import Publication, Transmission
from schemas.settings import Settings
from services.simulator.truth_node import TruthNode

BOOT_NS = LOCKSTEP_EPOCH_NS - 7_000_000_000
LATITUDE_1E7, LONGITUDE_1E7, ALTITUDE_MM = 473_977_420, 85_455_940, 489_400


class Px4:
    """What the simulation at the other end says."""

    def __init__(self, **simulator) -> None:
        self.node = TruthNode(Settings(simulator={"kind": "mavlink_truth", **simulator}))
        self.mav = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self.now_ns = LOCKSTEP_EPOCH_NS

    def say(self, message) -> list:
        data = message.pack(self.mav)
        self.mav.seq = (self.mav.seq + 1) % 256
        return [
            output.message
            for output in self.node.on_bytes("vehicle", data, self.now_ns)
            if isinstance(output, Publication)
        ]

    def asked(self) -> list:
        parser = mavlink.MAVLink(None)
        data = b"".join(output.data for output in self.node.on_tick(self.now_ns) if isinstance(output, Transmission))
        return parser.parse_buffer(data) or []

    def answer_timesync(self, delay_ns: int = 2_000_000) -> None:
        asked = next(message for message in self.asked() if message.get_type() == "TIMESYNC")
        self.now_ns += delay_ns
        self.say(mavlink.MAVLink_timesync_message(self.now_ns - delay_ns // 2 - BOOT_NS, asked.ts1))

    def floor(self, altitude_amsl_m: float = ALTITUDE_MM / 1000) -> None:
        """Answer with the altitude of the ground."""
        self.say(mavlink.MAVLink_param_value_message(b"SIH_LOC_H0", altitude_amsl_m, 9, 1, 0))

    def floor_asked(self) -> bool:
        return any(message.get_type() == "PARAM_REQUEST_READ" for message in self.asked())

    def landed(self, state: int = 1) -> None:
        self.say(mavlink.MAVLink_extended_sys_state_message(0, state))

    def truth(self, up_m: float = 0.0, north_m: float = 0.0, q=(1.0, 0.0, 0.0, 0.0)) -> list:
        self.now_ns += 10_000_000
        time_us = (self.now_ns - BOOT_NS) // 1000
        latitude = LATITUDE_1E7 + round(north_m / 111_170.0 * 1e7)
        altitude = ALTITUDE_MM + round(up_m * 1000)
        return self.say(
            mavlink.MAVLink_hil_state_quaternion_message(
                time_us, list(q), 0.0, 0.0, 0.0, latitude, LONGITUDE_1E7, altitude, 0, 0, 0, 0, 0, 0, 0, 0
            )
        )


@pytest.fixture
def px4() -> Px4:
    return Px4(pad={"north_m": 5.0, "east_m": 0.0})


def test_it_asks_for_the_truth_until_it_comes(px4):
    wanted = [message.param1 for message in px4.asked() if message.get_type() == "COMMAND_LONG"]
    assert mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION in wanted
    px4.now_ns += 1_500_000_000
    assert any(message.get_type() == "COMMAND_LONG" for message in px4.asked())
    assert "no ground truth" in px4.node.complaints(px4.now_ns)[0]
    px4.truth()
    px4.now_ns += 990_000_000
    assert not any(message.get_type() == "COMMAND_LONG" for message in px4.asked())


def test_nothing_is_published_before_time_and_home_are_known(px4):
    px4.floor()
    assert px4.truth() == []
    px4.answer_timesync()
    px4.landed(2)
    assert px4.truth(up_m=3.0) == []
    px4.landed(1)
    assert len(px4.truth()) == 1


def test_the_pad_lies_at_its_offset_from_where_the_vehicle_first_stood(px4):
    px4.answer_timesync()
    px4.floor()
    px4.landed()
    (standing,) = px4.truth()
    (flying,) = px4.truth(up_m=10.0, north_m=5.0)
    assert standing.vehicle_from_pad_ned_m == pytest.approx((-5.0, 0.0, -0.2), abs=0.01)
    assert standing.touching_ground
    assert flying.vehicle_from_pad_ned_m == pytest.approx((0.0, 0.0, -10.2), abs=0.02)
    assert not flying.touching_ground


@pytest.mark.parametrize("sunk_m", [0.0, 0.25])
def test_a_vehicle_that_has_sunk_into_the_ground_tells_not_where_the_ground_is(px4, sunk_m):
    """The simulation leaves it where its last step had brought it; the next landing ends on the ground again."""
    px4.answer_timesync()
    px4.floor()
    px4.landed()
    (standing,) = px4.truth(up_m=-sunk_m)
    px4.truth(up_m=3.0)
    (landed,) = px4.truth(up_m=-0.001)
    assert standing.touching_ground and landed.touching_ground
    assert landed.vehicle_from_pad_ned_m[2] == pytest.approx(-0.2, abs=0.01)


def test_without_an_answer_the_vehicle_is_taken_to_stand_on_the_ground(px4):
    """Another simulation has no such parameter. It is asked a few times, from when it is first heard, and no more."""
    px4.answer_timesync()
    px4.landed()
    for _ in range(20):  # nothing is heard yet, however long that takes
        px4.now_ns += 500_000_000
        assert px4.floor_asked()
    published: list = []
    asked = 0
    while not published:
        published = px4.truth(up_m=1.5)
        px4.now_ns += 500_000_000
        asked += px4.floor_asked()
        assert asked < 10
    assert published[0].touching_ground and published[0].vehicle_from_pad_ned_m[2] == pytest.approx(-0.2, abs=0.01)
    px4.now_ns += 500_000_000
    assert not px4.floor_asked()


def test_a_ground_that_is_far_from_where_the_vehicle_stands_is_not_believed(px4):
    px4.answer_timesync()
    px4.floor(altitude_amsl_m=0.0)
    px4.landed()
    (standing,) = px4.truth()
    assert standing.touching_ground


def test_its_stamp_is_the_sample_time_in_utc(px4):
    px4.answer_timesync()
    px4.floor()
    px4.landed()
    (message,) = px4.truth()
    assert message.at_ns == pytest.approx(px4.now_ns, abs=2_000)


def test_a_flipped_quaternion_is_the_same_attitude_and_nonsense_is_dropped(px4):
    px4.answer_timesync()
    px4.floor()
    px4.landed()
    half = math.sqrt(0.5)
    (one,) = px4.truth(q=(half, 0.0, 0.0, half))
    (other,) = px4.truth(q=(-half, 0.0, 0.0, -half))
    assert one.q_ned_body == pytest.approx(other.q_ned_body)
    assert px4.truth(q=(0.0, 0.0, 0.0, 0.0)) == []
    assert px4.truth(q=(math.nan, 0.0, 0.0, 0.0)) == []


def test_it_says_what_it_waits_for(px4):
    def waits_for() -> str:
        return "; ".join(px4.node.complaints(px4.now_ns))

    px4.truth()
    assert "SIH_LOC_H0" in waits_for()
    px4.floor()
    assert "stand on the ground" in waits_for()
    px4.landed()
    px4.truth()
    assert "TIMESYNC" in waits_for()
    px4.answer_timesync()
    assert waits_for() == ""
