"""How often a whole frame is searched while the pad is away."""

from itertools import pairwise

from services.detector.aided.patience import Patience

FRAME_NS = 33_333_333
BEGAN_NS = 10**18


def searched(patience: Patience, first: int, frames: int) -> list[int]:
    return [number for number in range(first, first + frames) if patience.allows(BEGAN_NS + number * FRAME_NS)]


def test_every_frame_of_the_first_second_is_searched_and_then_a_few_a_second() -> None:
    patience = Patience()
    assert searched(patience, 0, 30) == list(range(30))
    later = searched(patience, 31, 300)
    assert 28 <= len(later) <= 34
    gaps = {after - before for before, after in pairwise(later)}
    assert max(gaps) <= 10


def test_when_the_pad_was_seen_it_is_eager_again() -> None:
    patience = Patience()
    searched(patience, 0, 90)
    patience.found()
    assert searched(patience, 90, 20) == list(range(90, 110))


def test_pictures_that_are_no_stream_are_all_searched() -> None:
    assert all(Patience().allows(0) for _ in range(50))
    patience = Patience()
    assert all(patience.allows(BEGAN_NS + number * 10**10) for number in range(50))
    assert all(patience.allows(0) for _ in range(50))


def test_where_the_absence_is_explained_it_searches_once_a_second_from_the_beginning() -> None:
    patience = Patience()
    frames = [number for number in range(150) if patience.allows(BEGAN_NS + number * FRAME_NS, explained=True)]
    assert frames[0] == 0
    assert 5 <= len(frames) <= 6
    assert {after - before for before, after in pairwise(frames)} <= {30, 31}


def test_when_the_explanation_ends_it_is_eager_at_once() -> None:
    patience = Patience()
    for number in range(90):
        patience.allows(BEGAN_NS + number * FRAME_NS, explained=True)
    assert searched(patience, 90, 30) == list(range(90, 120))
