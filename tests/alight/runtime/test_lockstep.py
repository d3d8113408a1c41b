"""Lockstep: same order every time, virtual durations kept, what is held back is held back."""

from collections.abc import Iterator

from alight.runtime.clock import NS_PER_S, nanoseconds
from alight.runtime.lockstep import Lockstep
from alight.runtime.node import Arrival, Node, Output, Publication, Transmission
from schemas import topics
from schemas.detection import Detection
from schemas.fix import FixVerdict, PadFix
from schemas.settings import Settings


class Seeing(Node):
    """A detector that sees nothing, ten times a second."""

    service = "detector"
    tick_period_ns = nanoseconds(0.1)

    def on_tick(self, now_ns: int) -> Iterator[Output]:
        self.ticks = getattr(self, "ticks", 0) + 1
        held_until_ns = now_ns + nanoseconds(0.02)
        yield Publication(
            topics.DETECTION,
            Detection(captured_at_ns=now_ns, frame_sequence=self.ticks, detector="blind"),
            release_at_ns=held_until_ns,
        )


class Placing(Node):
    """A geolocator that refuses, and notes when it heard what."""

    service = "geolocator"

    def __init__(self) -> None:
        super().__init__()
        self.heard: list[tuple[int, int]] = []
        self.subscribe(topics.DETECTION, self.on_detection)

    def on_detection(self, arrival: Arrival[Detection]) -> Iterator[Output]:
        self.heard.append((arrival.message.captured_at_ns, arrival.now_ns))
        detection = arrival.message
        yield Publication(
            topics.PAD_FIX,
            PadFix(captured_at_ns=detection.captured_at_ns, hops=detection.hops, verdict=FixVerdict.NO_MARKER),
        )


class Listening(Node):
    """A filter that keeps what it heard."""

    service = "filter"

    def __init__(self) -> None:
        super().__init__()
        self.fixes: list[PadFix] = []
        self.subscribe(topics.PAD_FIX, self.on_fix)

    def on_fix(self, arrival: Arrival[PadFix]) -> tuple[()]:
        self.fixes.append(arrival.message)
        return ()


class Echo(Node):
    """Sends back what comes through its port, one byte longer."""

    def __init__(self, service: str, first: bytes = b"") -> None:
        super().__init__()
        self.service = service  # type: ignore[misc]
        self.ports = ("vehicle",)
        self.tick_period_ns = nanoseconds(10.0) if first else None
        self.first = first
        self.got: list[bytes] = []

    def on_tick(self, now_ns: int) -> Iterator[Output]:
        yield Transmission("vehicle", self.first)

    def on_bytes(self, port: str, data: bytes, now_ns: int) -> Iterator[Output]:
        self.got.append(data)
        if len(data) < 5:
            yield Transmission(port, data + b".")


def fly(settings: Settings) -> tuple[Placing, Listening]:
    placing, listening = Placing(), Listening()
    lockstep = Lockstep([Seeing(), placing, listening], settings)
    lockstep.run(lockstep.clock.now_ns() + NS_PER_S)
    return placing, listening


def test_the_same_flight_twice_is_the_same() -> None:
    first, second = fly(Settings()), fly(Settings())
    assert first[1].fixes == second[1].fixes
    assert len(first[1].fixes) == 10


def test_what_is_held_back_arrives_after_release_and_hop() -> None:
    settings = Settings()
    placing, _ = fly(settings)
    delays_s = {(heard_ns - captured_ns) / NS_PER_S for captured_ns, heard_ns in placing.heard}
    assert delays_s == {0.02 + settings.lockstep.hop_s}


def test_each_hop_tells_when_it_was_received_and_published() -> None:
    settings = Settings()
    _, listening = fly(settings)
    detector, geolocator = listening.fixes[0].hops
    assert (detector.service, geolocator.service) == ("detector", "geolocator")
    assert geolocator.received_at_ns - detector.published_at_ns == nanoseconds(settings.lockstep.hop_s)
    processing_ns = nanoseconds(settings.lockstep.processing_s["geolocator"])
    assert geolocator.published_at_ns - geolocator.handled_at_ns == processing_ns


def test_a_pipe_carries_bytes_both_ways() -> None:
    one, other = Echo("simulator", first=b"ab"), Echo("commander")
    lockstep = Lockstep([one, other], Settings())
    lockstep.join(one, "vehicle", other, "vehicle")
    lockstep.run(lockstep.clock.now_ns() + NS_PER_S)
    assert other.got == [b"ab", b"ab.."]
    assert one.got == [b"ab.", b"ab..."]
