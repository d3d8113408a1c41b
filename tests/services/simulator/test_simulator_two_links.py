"""A ground control station beside the companion: two links to one autopilot, as PX4 has."""

from pymavlink.dialects.v20 import development as mavlink

from alight.runtime.clock import LOCKSTEP_EPOCH_NS
from alight.runtime.node import Transmission
from schemas.settings import Settings
from services.simulator.node import SimulatorNode

TICK_NS = 4_000_000
TWO_LINKS = Settings(simulator={"gcs_url": "udp://127.0.0.1:18570?to=127.0.0.1:14550", "airborne": {}})


class Bench:
    """A node whose ports are read one by one."""

    def __init__(self, settings: Settings) -> None:
        self.node = SimulatorNode(settings)
        self.now_ns = LOCKSTEP_EPOCH_NS
        self.parsers = {port: mavlink.MAVLink(None) for port in ("vehicle", "gcs")}
        self.heard: dict[str, list] = {"vehicle": [], "gcs": []}

    def take(self, outputs) -> None:
        for output in outputs:
            if isinstance(output, Transmission):
                self.heard[output.port] += self.parsers[output.port].parse_buffer(output.data) or []

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 250)):
            self.now_ns += TICK_NS
            self.take(self.node.on_tick(self.now_ns))

    def send(self, port: str, message, system: int, component: int) -> None:
        data = message.pack(mavlink.MAVLink(None, srcSystem=system, srcComponent=component))
        self.take(self.node.on_bytes(port, data, self.now_ns))

    def kinds(self, port: str, system: int = 1) -> set[str]:
        return {message.get_type() for message in self.heard[port] if message.get_srcSystem() == system}


def test_without_a_second_link_there_is_one_port():
    assert SimulatorNode(Settings()).ports == ("vehicle",)
    assert SimulatorNode(TWO_LINKS).ports == ("vehicle", "gcs")


def test_texts_go_to_the_link_where_the_station_is_and_answers_to_the_link_that_asked():
    bench = Bench(TWO_LINKS)
    bench.run(0.5)
    bench.send("gcs", mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3), 255, 190)
    bench.send("gcs", mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_NAV_LAND, 0, *[0.0] * 7), 255, 190)
    bench.run(0.5)
    assert {"STATUSTEXT", "COMMAND_ACK"} <= bench.kinds("gcs")
    assert not {"STATUSTEXT", "COMMAND_ACK"} & bench.kinds("vehicle")
    assert "ATTITUDE" in bench.kinds("vehicle") & bench.kinds("gcs")


def test_the_station_is_heard_on_the_companions_link_and_a_rate_belongs_to_its_link():
    bench = Bench(TWO_LINKS)
    bench.run(0.5)
    bench.send("gcs", mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3), 255, 190)
    assert bench.kinds("vehicle", system=255) == {"HEARTBEAT"}
    off = mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0, 30.0, -1.0, *[0.0] * 5)
    bench.send("gcs", off, 255, 190)
    bench.heard = {"vehicle": [], "gcs": []}
    bench.run(0.5)
    assert "ATTITUDE" in bench.kinds("vehicle")
    assert "ATTITUDE" not in bench.kinds("gcs")
