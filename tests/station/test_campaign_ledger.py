"""What is flown is written down once, and survives whatever becomes of the writer."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from station.campaign.crew import Flown
from station.campaign.ledger import FLIGHTS, Ledger
from station.campaign.spec import CampaignSpec, SpecError

SPEC = CampaignSpec(name="one", flights=10)


def flown(index: int, error_m: float = 0.1, software: str = "this") -> Flown:
    return Flown({"index": index, "landed": True, "error_m": error_m}, 1.5, "here", software)


def ledger(out: Path, spec: CampaignSpec = SPEC, software: str = "this") -> Ledger:
    return Ledger(out, spec, software)


def test_what_was_written_is_there_the_next_time(tmp_path: Path) -> None:
    with ledger(tmp_path) as first:
        assert first.add(flown(3))
        assert first.add(flown(1))
    with ledger(tmp_path) as second:
        assert second.rows == {3: flown(3).row, 1: flown(1).row}
        assert second.timings[3].took_s == 1.5


def test_a_flight_is_counted_once(tmp_path: Path) -> None:
    with ledger(tmp_path) as book:
        assert book.add(flown(3, 0.1))
        assert not book.add(flown(3, 0.2))
    with ledger(tmp_path) as book:
        assert not book.add(flown(3, 0.3))
        assert book.rows[3]["error_m"] == 0.1
    assert (tmp_path / FLIGHTS).read_bytes().count(b"\n") == 1


@given(cut=st.integers(1, 200))
def test_a_line_that_was_cut_off_is_flown_again_and_nothing_else_is(
    tmp_path_factory: pytest.TempPathFactory, cut: int
) -> None:
    out = tmp_path_factory.mktemp("cut")
    with ledger(out) as book:
        for index in range(5):
            book.add(flown(index))
    whole = (out / FLIGHTS).read_bytes()
    (out / FLIGHTS).write_bytes(whole[:-cut])
    with ledger(out) as book:
        kept = len(book.rows)
        assert list(book.rows) == list(range(kept))
        assert kept == whole[:-cut].count(b"\n")
        for index in range(5):
            assert book.add(flown(index)) == (index >= kept)
    assert (out / FLIGHTS).read_bytes() == whole


def test_another_spec_is_refused_by_digest(tmp_path: Path) -> None:
    ledger(tmp_path).__exit__(None, None, None)
    other = CampaignSpec(name="other", flights=10)
    with pytest.raises(SpecError) as caught:
        ledger(tmp_path, other)
    assert SPEC.digest[:12] in str(caught.value)
    assert other.digest[:12] in str(caught.value)
    assert "--out" in str(caught.value)


def test_more_flights_go_on(tmp_path: Path) -> None:
    with ledger(tmp_path) as book:
        book.add(flown(0))
    with ledger(tmp_path, CampaignSpec(name="one", flights=20)) as book:
        assert list(book.rows) == [0]


def test_other_software_is_refused_at_the_start_and_from_a_crew(tmp_path: Path) -> None:
    with ledger(tmp_path) as book, pytest.raises(SpecError, match=r"flies with other software \(that\)"):
        book.add(flown(0, software="that"))
    with pytest.raises(SpecError, match="begun with other software"):
        ledger(tmp_path, software="that")


def test_two_campaigns_do_not_write_into_one_folder(tmp_path: Path) -> None:
    with ledger(tmp_path), pytest.raises(SpecError, match="a campaign is running there"):
        ledger(tmp_path)
    with ledger(tmp_path) as book:
        assert book.add(flown(0))
