"""Whatever autopilot, estimates and people send, in any order: a phase that has let go sends nothing that moves the vehicle."""

from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import development as mavlink

from alight.runtime.node import Arrival, Outputs, Publication, Transmission
from schemas import topics
from schemas.estimate import PadEstimate
from schemas.message import GlobalPosition
from schemas.mission import MissionRequest, Phase, Verb
from schemas.settings import Settings
from services.commander.framing import MavlinkFramer
from services.commander.node import CommanderNode
from services.commander.transitions import ACTIVE

START = 1_767_225_600_000_000_000
MODES = [0x02040000, 0x03040000, 0x05040000, 0x06040000, 0x00060000, 0x00030000, 0]
MOVING = {
    mavlink.MAV_CMD_NAV_TAKEOFF,
    mavlink.MAV_CMD_NAV_LAND,
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM,
}
SAYS = st.one_of(
    st.tuples(st.just("wait"), st.integers(1, 60)),
    st.tuples(st.just("mode"), st.sampled_from(MODES), st.booleans()),
    st.tuples(st.just("heartbeat"), st.booleans(), st.sampled_from(MODES), st.sampled_from([0, 3, 4, 4, 4, 5])),
    st.tuples(st.just("landed"), st.integers(0, 4)),
    st.tuples(st.just("ack"), st.sampled_from([22, 21, 176, 192, 400]), st.integers(0, 6)),
    st.tuples(st.just("estimate"), st.floats(-30.0, 30.0), st.floats(-2.0, 30.0)),
    st.tuples(st.just("request"), st.sampled_from(Verb)),
    st.tuples(st.just("reboot")),
    st.tuples(st.just("junk"), st.binary(max_size=40)),
)


class AnyAutopilot:
    """Says whatever it is told to say, as MAVLink, and keeps saying where it is."""

    def __init__(self) -> None:
        self.node = CommanderNode(Settings())
        self.now_ns = START
        self.booted_ns = START - 10**10
        self._encoder = mavlink.MAVLink(None, 1, 1)
        self._framer = MavlinkFramer()
        self._requests = 0
        self.phase = Phase.IDLE
        self.mode, self.armed = 0x03040000, True

    def say(self, message: Any) -> None:
        self._check(self.node.on_bytes("vehicle", message.pack(self._encoder), self.now_ns))

    def heartbeat(self, armed: bool, mode: int, status: int) -> None:
        self.mode, self.armed = mode, armed
        self.say(mavlink.MAVLink_heartbeat_message(2, 12, 0x80 * armed + 1, mode, status, 3))

    def wait(self, ticks: int) -> None:
        for tick in range(ticks):
            self.now_ns += 20_000_000
            boot_ms = (self.now_ns - self.booted_ns) // 1_000_000
            self.say(mavlink.MAVLink_gps_raw_int_message(0, 3, 0, 0, 500000, 0, 0, 0, 0, 9, 547000))
            self.say(mavlink.MAVLink_attitude_quaternion_message(boot_ms, 1, 0, 0, 0, 0, 0, 0))
            self.say(mavlink.MAVLink_global_position_int_message(boot_ms, 470000000, 80000000, 510000, 0, 0, 0, 0, 0))
            if tick % 25 == 0:
                self.say(mavlink.MAVLink_heartbeat_message(2, 12, 0x80 * self.armed + 1, self.mode, 4, 3))
            self._check(self.node.on_tick(self.now_ns))

    def do(self, what: str, *how: Any) -> None:
        self.now_ns += 1_000_000
        if what == "wait":
            self.wait(how[0])
        elif what == "mode":
            self.mode = how[0]
            intended = how[0] if how[1] else 0x00060000
            self.say(mavlink.MAVLink_current_mode_message(0, how[0], intended))
        elif what == "heartbeat":
            self.heartbeat(*how)
        elif what == "landed":
            self.say(mavlink.MAVLink_extended_sys_state_message(0, how[0]))
        elif what == "ack":
            self.say(mavlink.MAVLink_command_ack_message(how[0], how[1], 0, 0, 245, 191))
        elif what == "reboot":
            self.booted_ns = self.now_ns
        elif what == "junk":
            self._check(self.node.on_bytes("vehicle", how[0], self.now_ns))
        elif what == "estimate":
            self._deliver(topics.PAD_ESTIMATE, self._estimate(*how))
        elif what == "request":
            self._requests += 1
            request = MissionRequest(at_ns=self.now_ns, request_id=f"{self._requests}", verb=how[0])
            self._deliver(topics.REQUEST, request)

    def _estimate(self, north: float, below: float) -> PadEstimate:
        pad = GlobalPosition(
            latitude_deg=47.0 + north * 9e-6,
            longitude_deg=8.0,
            altitude_amsl_m=510.0 - below,
            ellipsoidal_height_m=557.0 - below,
        )
        return PadEstimate(
            captured_at_ns=self.now_ns - 30_000_000,
            position=pad,
            pad_ned_m=(north, 0.0, below),
            azimuth_rad=0.0,
            covariance_ned_m2=(0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01),
            azimuth_variance_rad2=0.01,
            method="any",
            fixes_used=1,
        )

    def _deliver(self, topic: topics.Topic[Any], message: Any) -> None:
        self._check(self.node.on_message(Arrival(topic, message, self.now_ns, self.now_ns)))

    def _check(self, outputs: Outputs) -> None:
        before, moving = self.phase, []
        for output in outputs:
            if isinstance(output, Publication) and output.topic is topics.MISSION_STATUS:
                self.phase = output.message.phase  # type: ignore[attr-defined]
            elif isinstance(output, Transmission):
                moving += [message for message in self._framer.feed(output.data) if self._moves(message)]
        if before not in ACTIVE and self.phase not in ACTIVE:
            assert not moving, (before, self.phase, moving)
        # A deed of the phase that has just ended is over before the new phase is told.
        if self.phase not in ACTIVE:
            assert all(message.get_type() != "SET_POSITION_TARGET_GLOBAL_INT" for message in moving)

    def _moves(self, message: Any) -> bool:
        kind = message.get_type()
        if kind.startswith("SET_POSITION_TARGET"):
            return True
        if kind == "COMMAND_INT":  # To where the vehicle is, it is a hold.
            return (message.x, message.y, round(message.z)) != (470000000, 80000000, 510)
        if kind != "COMMAND_LONG":
            return False
        hold = (4.0, 3.0)
        to_another_mode = message.command == mavlink.MAV_CMD_DO_SET_MODE and (message.param2, message.param3) != hold
        return message.command in MOVING or to_another_mode


@settings(max_examples=60)
@given(st.lists(SAYS, max_size=40))
def test_a_phase_that_has_let_go_moves_nothing(said: list[tuple[Any, ...]]) -> None:
    autopilot = AnyAutopilot()
    autopilot.heartbeat(True, 0x03040000, 4)
    autopilot.say(mavlink.MAVLink_extended_sys_state_message(0, 2))
    home = mavlink.MAVLink_home_position_message(470000000, 80000000, 500000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)
    autopilot.say(home)
    autopilot.wait(20)
    for what in said:
        autopilot.do(*what)


def test_the_stage_above_can_reach_a_descent() -> None:
    """Lest the property hold because nothing ever happens."""
    autopilot = AnyAutopilot()
    test_setup = [("heartbeat", True, 0x03040000, 4), ("landed", 2)]
    for what in test_setup:
        autopilot.do(*what)
    autopilot.say(mavlink.MAVLink_home_position_message(470000000, 80000000, 500000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0))
    autopilot.wait(50)
    autopilot.do("request", Verb.LAND)
    for _ in range(30):
        autopilot.do("estimate", 1.0, 10.0)
        autopilot.wait(2)
    assert autopilot.phase is Phase.DESCEND
    autopilot.do("heartbeat", True, 0x05040000, 5)
    assert autopilot.phase is Phase.YIELDED
