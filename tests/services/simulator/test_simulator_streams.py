"""Telemetry, time, parameters and texts of the simulated autopilot, seen from outside."""

import struct
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mavlink_client import TICK_NS, Client
from pymavlink.dialects.v20 import development as mavlink

from alight.runtime.clock import LOCKSTEP_EPOCH_NS
from alight.runtime.node import Publication, Transmission
from schemas.settings import Settings
from services.simulator.node import SimulatorNode

ACCEPTED, DENIED, FAILED = 0, 2, 4


def rate_hz(client: Client, kind: str, seconds: float = 5.0) -> float:
    client.run(seconds)
    return len(client.messages(kind, since_s=client.time_s - seconds)) / seconds


def test_the_default_rates_are_those_of_px4s_onboard_link():
    client = Client().run(8.0)
    mark = client.time_s
    client.run(10.0)
    counts = Counter(message.get_type() for at_s, message in client.log if at_s >= mark)
    expected = {
        "ATTITUDE": 100, "ATTITUDE_QUATERNION": 50, "GLOBAL_POSITION_INT": 50, "LOCAL_POSITION_NED": 30, "ALTITUDE": 10,
        "VFR_HUD": 10, "TIMESYNC": 10, "POSITION_TARGET_LOCAL_NED": 10, "GPS_RAW_INT": 8, "EXTENDED_SYS_STATE": 5,
        "SYS_STATUS": 5, "HEARTBEAT": 1, "SYSTEM_TIME": 1, "HOME_POSITION": 0.5, "BATTERY_STATUS": 0.5, "CURRENT_MODE": 0.5,
    }  # fmt: skip
    for kind, hz in expected.items():
        assert counts[kind] / 10.0 == pytest.approx(hz, rel=0.03, abs=0.11), kind


def test_rates_can_be_asked_for_switched_off_and_set_back():
    client = Client().run(6.0)
    assert client.command(511, 31.0, 10_000.0) == ACCEPTED
    assert rate_hz(client, "ATTITUDE_QUATERNION") == pytest.approx(100, rel=0.02)
    assert client.command(511, 31.0, -1.0) == ACCEPTED
    client.run(0.1)
    assert rate_hz(client, "ATTITUDE_QUATERNION", 2.0) == 0.0
    assert client.command(510, 31.0) == ACCEPTED
    assert client.last("MESSAGE_INTERVAL").interval_us == -1
    assert client.command(511, 31.0, 0.0) == ACCEPTED
    assert rate_hz(client, "ATTITUDE_QUATERNION") == pytest.approx(50, rel=0.02)


@pytest.mark.parametrize("message_id", [0.0, 108.0, 60000.0, float("nan")])
def test_rates_that_cannot_be_set_fail(message_id):
    assert Client().run(1.0).command(511, message_id, 10_000.0) == FAILED


def test_telemetry_leaves_when_the_clock_reaches_its_stamp():
    client = Client().run(6.0)
    for at_s, message in client.log:
        if message.get_type() in ("ATTITUDE", "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"):
            assert message.time_boot_ms * 1e-3 == pytest.approx(at_s - 0.004, abs=0.0041)


def test_timesync_tells_the_clock_that_the_telemetry_is_stamped_with():
    client = Client().run(6.0)
    asked_ns = client.now_ns
    client.send(mavlink.MAVLink_timesync_message(0, 12345))
    answer = next(message for message in reversed(client.messages("TIMESYNC")) if message.tc1)
    assert answer.ts1 == 12345
    boot_ns = asked_ns - answer.tc1
    client.run(1.0)
    newest_ns = boot_ns + client.last("ATTITUDE").time_boot_ms * 1_000_000
    assert 0 <= client.now_ns - newest_ns <= 14_000_000


def test_the_autopilot_asks_for_the_time_too_and_a_ping_is_answered():
    client = Client().run(3.0)
    assert any(message.tc1 == 0 for message in client.messages("TIMESYNC"))
    client.send(mavlink.MAVLink_ping_message(77, 5, 0, 0))
    assert any((m.seq, m.target_system, m.target_component) == (5, 245, 191) for m in client.messages("PING"))


def test_texts_go_only_where_a_ground_station_was_heard():
    for is_gcs in (True, False):
        client = Client(gcs=is_gcs)
        client.until(lambda client=client: client.status == 3, 10)
        client.arm()
        client.run(1.0)
        assert ("Armed by external command" in client.texts()) is is_gcs


def test_a_long_text_comes_in_chunks_with_one_id():
    client = Client().run(2.5)
    client.arm()
    client.run(2.0)
    chunks = [message for message in client.messages("STATUSTEXT") if message.severity == 2]
    assert [chunk.chunk_seq for chunk in chunks[:2]] == [0, 1]
    assert chunks[0].id == chunks[1].id
    assert "".join(chunk.text for chunk in chunks[:2]) == "Arming denied: Resolve system health failures first\t"


def test_messages_are_sent_on_request_but_not_twice_without_news():
    client = Client().run(6.0)
    assert client.command(512, 148.0) == ACCEPTED
    assert client.last("AUTOPILOT_VERSION").capabilities & mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    assert client.command(512, 49.0) == ACCEPTED
    assert client.command(512, 242.0) == DENIED
    assert client.command(512, 60000.0) == DENIED


def test_a_parameter_is_read_changed_and_listed():
    client = Client().run(3.0)
    client.send(mavlink.MAVLink_param_request_read_message(1, 1, b"COM_OBL_RC_ACT", -1))
    assert client.last("PARAM_VALUE").param_type == mavlink.MAV_PARAM_TYPE_INT32
    bytewise = struct.unpack("<f", struct.pack("<i", 5))[0]
    client.send(mavlink.MAVLink_param_set_message(1, 1, b"COM_OBL_RC_ACT", bytewise, mavlink.MAV_PARAM_TYPE_INT32))
    assert struct.unpack("<i", struct.pack("<f", client.last("PARAM_VALUE").param_value))[0] == 5
    client.send(mavlink.MAVLink_param_set_message(1, 1, b"MPC_XY_CRUISE", 3.5, mavlink.MAV_PARAM_TYPE_REAL32))
    assert client.last("PARAM_VALUE").param_value == 3.5
    known = len(client.messages("PARAM_VALUE"))
    client.send(mavlink.MAVLink_param_request_read_message(1, 1, b"NO_SUCH", -1))
    assert len(client.messages("PARAM_VALUE")) == known
    client.send(mavlink.MAVLink_param_request_list_message(1, 1))
    listed = client.messages("PARAM_VALUE")[known:]
    assert len(listed) == listed[0].param_count
    assert [message.param_index for message in listed] == list(range(len(listed)))


def test_a_parameter_that_does_not_exist_stops_the_simulator_at_the_start():
    with pytest.raises(ValueError, match="NO_SUCH"):
        SimulatorNode(Settings(simulator={"parameters": {"NO_SUCH": 1.0}}))


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not():
    def flight(seed: int) -> tuple[bytes, tuple[float, float, float]]:
        wind = {"north_mps": 3.0, "gust_mps": 1.0}
        client = Client(Settings(seed=seed, simulator={"wind": wind, "airborne": {}})).run(5.0)
        client.reposition(5.0, 3.0, 500.0)
        client.run(5.0)
        return bytes(client.raw), client.truth.vehicle_from_pad_ned_m

    assert flight(3) == flight(3)
    assert flight(3) != flight(4)


def test_the_truth_is_ahead_of_the_clock_by_the_lead_and_comes_at_its_rate():
    client = Client(Settings(simulator={"lead_s": 0.04})).run(10.0)
    assert client.truth.at_ns - client.now_ns > 20_000_000
    assert all(truth.at_ns - client.now_ns <= 40_000_000 for truth in client.truths)
    assert len(client.truths) / 10.0 == pytest.approx(60.0, rel=0.02)


def test_a_late_process_catches_up_and_skips_what_is_hopeless():
    node = SimulatorNode(Settings(simulator={"lead_s": 0.0}))
    now_ns = LOCKSTEP_EPOCH_NS
    node.on_tick(now_ns)
    truths = [o.message for o in node.on_tick(now_ns + 100 * TICK_NS) if isinstance(o, Publication)]
    assert node.counters()["skipped_ms"] == 0
    assert truths[-1].at_ns > now_ns + 95 * TICK_NS
    node.on_tick(now_ns + 100 * TICK_NS + 3_000_000_000)
    assert node.counters()["skipped_ms"] == 3000
    later_ns = now_ns + 100 * TICK_NS + 4_000_000_000
    truths = [o.message for o in node.on_tick(later_ns - 600_000_000) if isinstance(o, Publication)]
    assert abs(truths[-1].at_ns - (later_ns - 600_000_000)) < 20_000_000


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=600))
def test_rubbish_on_the_link_is_swallowed(data):
    node = SimulatorNode(Settings())
    node.on_tick(LOCKSTEP_EPOCH_NS)
    assert all(isinstance(output, Transmission) for output in node.on_bytes("vehicle", data, LOCKSTEP_EPOCH_NS))
    client_message = mavlink.MAVLink_timesync_message(0, 1).pack(mavlink.MAVLink(None, srcSystem=245, srcComponent=191))
    replies = [o for _ in range(3) for o in node.on_bytes("vehicle", b"\x00" * 300 + client_message, LOCKSTEP_EPOCH_NS)]
    assert replies
