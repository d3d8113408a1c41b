"""The mailbox: order, newest-wins for frames, nothing lost that must not be."""

import random
import threading

from hypothesis import given
from hypothesis import strategies as st

from alight.runtime.mailbox import CAPACITY, Letter, Mailbox
from schemas import topics
from schemas.topics import Topic

TOPICS = {"frame": topics.FRAME, "state": topics.PAD_FIX, "event": topics.REQUEST}


def drained(mailbox: Mailbox) -> list[Letter]:
    letters = []
    while (letter := mailbox.take()) is not None:
        letters.append(letter)
    return letters


@given(kinds=st.lists(st.sampled_from(sorted(TOPICS)), max_size=60))
def test_frames_give_way_to_newer_ones_and_all_else_keeps_its_order(kinds: list[str]) -> None:
    dropped: list[Topic] = []
    mailbox = Mailbox(on_drop=dropped.append)
    for number, kind in enumerate(kinds):
        mailbox.put(Letter(number, TOPICS[kind]))
    taken = drained(mailbox)
    numbers = [letter.received_at_ns for letter in taken]
    frames = [number for number, kind in enumerate(kinds) if kind == "frame"]
    others = [number for number, kind in enumerate(kinds) if kind != "frame"]
    assert [number for number in numbers if number in others] == others
    assert [number for number in numbers if number in frames] == frames[-1:]
    assert len(dropped) == max(0, len(frames) - 1)


def test_a_frame_taken_up_is_not_replaced() -> None:
    mailbox = Mailbox(on_drop=lambda _: None)
    mailbox.put(Letter(1, topics.FRAME))
    assert mailbox.take() is not None
    mailbox.put(Letter(2, topics.FRAME))
    assert [letter.received_at_ns for letter in drained(mailbox)] == [2]


def test_frames_may_wait_in_line_for_who_wants_them_all() -> None:
    dropped: list[Topic] = []
    mailbox = Mailbox(on_drop=dropped.append, frames=3)
    for number in range(5):
        mailbox.put(Letter(number, topics.FRAME))
    first = mailbox.take()
    mailbox.put(Letter(5, topics.FRAME))
    assert first is not None and first.received_at_ns == 0
    assert [letter.received_at_ns for letter in drained(mailbox)] == [1, 4, 5]
    assert dropped == [topics.FRAME] * 2


def test_a_flood_of_state_is_bounded_and_costs_no_event() -> None:
    dropped: list[Topic] = []
    mailbox = Mailbox(on_drop=dropped.append)
    for number in range(CAPACITY + 10):
        mailbox.put(Letter(number, topics.PAD_FIX))
    mailbox.put(Letter(-1, topics.REQUEST))
    taken = [letter.received_at_ns for letter in drained(mailbox)]
    assert taken == [*range(CAPACITY), -1]
    assert len(dropped) == 10


def test_bytes_from_a_port_wait_in_line_with_messages() -> None:
    mailbox = Mailbox(on_drop=lambda _: None)
    mailbox.put(Letter(1, topics.PAD_FIX))
    mailbox.put(Letter(2, payload=b"abc", port="vehicle"))
    assert [letter.port for letter in drained(mailbox)] == ["", "vehicle"]


def test_short_waits_end_whether_or_not_a_letter_comes() -> None:
    # `SimpleQueue.get(timeout=...)` of CPython 3.11 hangs here within a few thousand calls.
    mailbox = Mailbox(on_drop=lambda _: None)
    chance = random.Random(1)

    def wait_often() -> None:
        for _ in range(20_000):
            if chance.random() < 0.3:
                mailbox.put(Letter(1, topics.PAD_FIX))
            mailbox.wait(chance.choice([0.0, 1e-6, 5e-6, 2e-5, 1e-4]))
            mailbox.take()

    thread = threading.Thread(target=wait_often, daemon=True)
    thread.start()
    thread.join(timeout=60.0)
    assert not thread.is_alive()


def test_no_letter_is_overslept() -> None:
    mailbox = Mailbox(on_drop=lambda _: None)
    taken: list[int] = []

    def read() -> None:
        while len(taken) < 500:
            mailbox.wait(timeout_s=60.0)
            while (letter := mailbox.take()) is not None:
                taken.append(letter.received_at_ns)

    thread = threading.Thread(target=read, daemon=True)
    thread.start()
    for number in range(500):
        mailbox.put(Letter(number, topics.PAD_FIX))
    thread.join(timeout=50.0)
    assert taken == list(range(500))


def test_whoever_waits_can_be_woken_without_a_letter() -> None:
    mailbox = Mailbox(on_drop=lambda _: None)
    thread = threading.Thread(target=mailbox.wait, args=(60.0,), daemon=True)
    thread.start()
    mailbox.ring()
    thread.join(timeout=50.0)
    assert not thread.is_alive() and mailbox.is_empty()
