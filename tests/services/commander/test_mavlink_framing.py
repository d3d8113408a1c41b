"""Bytes in, messages out: whatever the bytes are."""

from hypothesis import example, given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import development as mavlink

from services.commander.framing import MavlinkFramer


def packed(count: int) -> list[bytes]:
    encoder = mavlink.MAVLink(None, 1, 1)
    frames = []
    for i in range(count):
        message = mavlink.MAVLink_global_position_int_message(i, 470000000 + i, 80000000, 0, 0, 0, 0, 0, 0)
        frames.append(message.pack(encoder))
        encoder.seq = (encoder.seq + 1) % 256
    return frames


@given(st.lists(st.integers(1, 60), min_size=1, max_size=40))
def test_chunks_of_any_size_give_the_same_messages(sizes: list[int]) -> None:
    stream = b"".join(packed(20))
    framer, found, at = MavlinkFramer(), [], 0
    for size in sizes * (1 + len(stream) // sum(sizes)):
        found += framer.feed(stream[at : at + size])
        at += size
    assert [message.time_boot_ms for message in found] == list(range(20))


@given(st.binary(max_size=600))
@example(b"\xfd\xff" * 100)
def test_nothing_that_comes_in_raises(junk: bytes) -> None:
    MavlinkFramer().feed(junk)


@given(st.integers(0, 9), st.integers(1, 30), st.integers(1, 255))
def test_a_corrupted_frame_costs_only_itself(which: int, where: int, flip: int) -> None:
    frames = packed(10)
    damaged = bytearray(frames[which])
    # The length byte would make it another frame, and the flags another protocol: those may cost a neighbour as well.
    where = 10 + where % (len(damaged) - 12)
    damaged[where] ^= flip
    framer = MavlinkFramer()
    found = framer.feed(b"".join([*frames[:which], bytes(damaged), *frames[which + 1 :]]) + bytes(300))
    assert [message.time_boot_ms for message in found] == [i for i in range(10) if i != which]
    assert framer.counts["bad_checksum"] >= 1


def test_a_message_of_another_dialect_is_counted_and_passed_over() -> None:
    frame = bytearray(packed(1)[0])
    frame[7:10] = (290).to_bytes(3, "little")
    framer = MavlinkFramer()
    assert len(framer.feed(bytes(frame) + packed(1)[0])) == 1
    assert framer.counts["unknown_message"] == 1


def test_a_message_that_nobody_wants_is_not_decoded_but_its_sender_is_heard() -> None:
    encoder = mavlink.MAVLink(None, 7, 1)
    unwanted = mavlink.MAVLink_attitude_message(5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    both = [unwanted.pack(encoder, force_mavlink1=old) + packed(1)[0] for old in (False, True)]
    for frames in both:
        framer = MavlinkFramer({"GLOBAL_POSITION_INT"})
        assert [message.get_type() for message in framer.feed(frames)] == ["GLOBAL_POSITION_INT"]
        assert framer.unread == [(7, 1)]
        assert framer.counts["frames"] == 2
        assert not framer.feed(b"")
        assert not framer.unread
