"""A UDP port at which anybody may write."""

import queue
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack

import pytest

from alight.runtime.clock import VirtualClock, nanoseconds
from alight.runtime.endpoint import UdpPort

HOST = "127.0.0.1"


class Desk:
    """A port bound to an address of this host, on a clock that the test moves, and programs that write to it."""

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack
        self.clock = VirtualClock()
        self.received: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind((HOST, 0))
            self.address = free.getsockname()
        self.port = UdpPort(bind=self.address, to=None, clock=self.clock)
        self.port.open(self.received.put)
        stack.callback(self.port.close)

    def program(self) -> socket.socket:
        """Another one, with a port of its own."""
        program = self._stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        program.bind((HOST, 0))
        program.settimeout(5.0)
        return program

    def write(self, program: socket.socket, data: bytes) -> None:
        program.sendto(data, self.address)

    def delivered(self) -> bytes:
        return self.received.get(timeout=5.0)

    def let_pass(self, for_s: float) -> None:
        self.clock.advance_to(self.clock.now_ns() + nanoseconds(for_s))


@pytest.fixture
def desk() -> Iterator[Desk]:
    with ExitStack() as stack:
        yield Desk(stack)


def test_a_stray_datagram_does_not_divert_what_is_sent(desk: Desk, caplog: pytest.LogCaptureFixture) -> None:
    autopilot, stranger = desk.program(), desk.program()
    desk.write(autopilot, b"heartbeat")
    assert desk.delivered() == b"heartbeat"
    desk.write(stranger, b"stray")
    deadline_s = time.monotonic() + 5.0
    while "datagrams of another sender dropped" not in caplog.text and time.monotonic() < deadline_s:
        time.sleep(0.001)
    desk.port.send(b"setpoint")
    assert autopilot.recv(99) == b"setpoint"


def test_what_a_stranger_writes_is_not_mixed_into_what_the_autopilot_writes(desk: Desk) -> None:
    autopilot, stranger = desk.program(), desk.program()
    for said in (b"heartbeat", b"attitude", b"position"):
        desk.write(autopilot, said)
        desk.write(stranger, b"stray")
    assert [desk.delivered() for _ in range(3)] == [b"heartbeat", b"attitude", b"position"]
    assert desk.received.empty()


def test_a_datagram_that_says_nothing_makes_nobody_the_one_who_is_answered(desk: Desk) -> None:
    scanner, autopilot = desk.program(), desk.program()
    desk.write(scanner, b"")
    desk.write(autopilot, b"heartbeat")
    assert desk.delivered() == b"heartbeat"
    desk.port.send(b"setpoint")
    assert autopilot.recv(99) == b"setpoint"


def test_an_autopilot_that_starts_anew_on_another_port_is_followed_when_the_old_one_is_silent(desk: Desk) -> None:
    before, after = desk.program(), desk.program()
    desk.write(before, b"before")
    assert desk.delivered() == b"before"
    desk.let_pass(2.1)
    desk.write(after, b"after")
    assert desk.delivered() == b"after"
    desk.port.send(b"question")
    assert after.recv(99) == b"question"
    desk.write(before, b"late")
    desk.write(after, b"still there")
    assert desk.delivered() == b"still there"


def test_a_port_that_sends_to_a_given_place_takes_answers_from_anywhere(desk: Desk) -> None:
    """A router may answer from another port than it listens at."""
    place, elsewhere = desk.program(), desk.program()
    received: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind((HOST, 0))
        address = free.getsockname()
    port = UdpPort(bind=address, to=place.getsockname())
    port.open(received.put)
    elsewhere.sendto(b"answer", address)
    assert received.get(timeout=5.0) == b"answer"
    port.send(b"question")
    assert place.recv(99) == b"question"
    port.close()
