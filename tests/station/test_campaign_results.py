"""The tables, the summary and the progress of a campaign."""

import io
import random
from pathlib import Path
from typing import Any

import pyarrow.parquet as parquet
import pytest

from station.campaign.ledger import Timing
from station.campaign.progress_bar import ProgressBar, progress_text
from station.campaign.recordings import worth_keeping
from station.campaign.row import MEASURED
from station.campaign.spec import Keep
from station.campaign.summary import summarise_rows, summary_text, wilson_interval
from station.campaign.tables import read_results, write_results, write_timings


def row(index: int, error_m: float | None, **more: Any) -> dict[str, Any]:
    landed = error_m is not None
    measured = dict.fromkeys(MEASURED) | {
        "outcome": "landed_on_pad" if landed else "not_landed",
        "landed": landed,
        "reason": "" if landed else f"not landed {index} s after the start",
        "touchdown_error_m": error_m,
    }
    return {"index": index, "wind.speed_mps": 0.5 * index, **measured, **more}


ROWS = [row(index, 0.01 * index if index % 5 else None) for index in range(40)]


def test_the_table_is_the_same_to_the_byte_in_whatever_order_the_flights_ended(tmp_path: Path) -> None:
    shuffled = random.Random(1).sample(ROWS, len(ROWS))
    for name, rows in (("one", ROWS), ("other", shuffled)):
        (tmp_path / name).mkdir()
        write_results(rows, tmp_path / name, "digest")
    one, other = ((tmp_path / name / "results.parquet").read_bytes() for name in ("one", "other"))
    assert one == other


def test_the_table_gives_back_what_was_written(tmp_path: Path) -> None:
    assert read_results(write_results(ROWS, tmp_path, "digest")) == ROWS


def test_factors_of_any_kind_have_a_column(tmp_path: Path) -> None:
    given = [
        {"mixed": 1, "section": {"a": 1}, "word": "glide", "flag": True},
        {"mixed": 2.5, "section": [3], "word": "x", "flag": False},
    ]
    rows = [row(index, 0.1, **values) for index, values in enumerate(given)]
    first, second = read_results(write_results(rows, tmp_path, "digest"))
    assert (first["mixed"], first["section"], first["word"], first["flag"]) == (1.0, '{"a": 1}', "glide", True)
    assert (second["mixed"], second["section"], second["word"], second["flag"]) == (2.5, "[3]", "x", False)


def test_a_column_in_which_nothing_was_measured_keeps_its_type(tmp_path: Path) -> None:
    crashed = parquet.read_schema(write_results([row(0, None)], tmp_path, "digest"))
    (tmp_path / "landed").mkdir()
    landed = parquet.read_schema(write_results([row(0, 0.1)], tmp_path / "landed", "digest"))
    assert crashed == landed


def test_times_stand_apart(tmp_path: Path) -> None:
    path = write_timings({1: Timing(2.0, "b"), 0: Timing(1.0, "a")}, tmp_path)
    assert read_results(path) == [{"index": 0, "took_s": 1.0, "by": "a"}, {"index": 1, "took_s": 2.0, "by": "b"}]


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [  # Wilson's interval as tabulated for z = 1.96
        (0, 10, 0.0, 0.2775),
        (10, 10, 0.7225, 1.0),
        (5, 10, 0.2366, 0.7634),
        (81, 263, 0.2553, 0.3662),
        (0, 0, 0.0, 1.0),
    ],
)
def test_wilsons_interval(successes: int, trials: int, low: float, high: float) -> None:
    assert wilson_interval(successes, trials) == pytest.approx((low, high), abs=5e-5)


def test_failures_are_counted_by_reason_whatever_their_numbers() -> None:
    rows = [row(0, 0.1), row(1, None), row(2, None), row(3, None, outcome="crashed", reason="ValueError: no")]
    summary = summarise_rows(rows)
    assert (summary.flights, summary.landed) == (4, 1)
    assert summary.failures == (
        ("not_landed: not landed # s after the start", 2, 1),
        ("crashed: ValueError: no", 1, 3),
    )


def test_the_errors_are_those_of_the_flights_that_landed() -> None:
    errors = summarise_rows([*(row(index, 0.01 * index) for index in range(101)), row(101, None)]).errors
    assert errors is not None
    assert (errors.median_m, errors.p95_m, errors.worst_m) == pytest.approx((0.50, 0.95, 1.00))


def test_each_combination_of_listed_values_gets_a_line() -> None:
    rows = [row(index, 0.1, guidance=["glide", "reposition"][index % 2]) for index in range(6)]
    text = "\n".join(summary_text(rows, ["guidance"]))
    assert text.startswith("landed     6 of 6 (100.0%; 95 % interval 61.0% to 100.0%)")
    assert "guidance = glide: landed 3 of 3" in text
    assert "guidance = reposition: landed 3 of 3" in text
    assert "error median 10.0 cm, 95 % below 10.0 cm, worst 10.0 cm" in text


def test_nothing_landed_is_said_plainly() -> None:
    text = "\n".join(summary_text([row(0, None)], []))
    assert text.startswith("landed     0 of 1 (0.0%;")
    assert "1 x not_landed: not landed # s after the start (first: flight 0)" in text


def test_the_worst_and_the_first_failed_are_kept() -> None:
    assert worth_keeping(ROWS, Keep(worst=2, failed=3)) == (39, 38, 0, 5, 10)
    assert worth_keeping(ROWS, Keep(worst=0, failed=0)) == ()


def test_the_time_left_follows_from_the_speed_of_this_run() -> None:
    text = progress_text(done=700, total=1000, flown=200, landed=190, elapsed_s=100.0)
    assert "700/1000" in text
    assert "190/200 landed" in text
    assert "2.00 flights/s" in text
    assert "2 min 30 s left" in text


def test_elsewhere_than_on_a_terminal_there_are_plain_lines() -> None:
    stream = io.StringIO()
    bar = ProgressBar(total=3, done_before=1, stream=stream)
    for landed in (True, False):
        bar.count(landed=landed)
    bar.end()
    lines = stream.getvalue().splitlines()
    assert "\x1b" not in stream.getvalue()
    assert "3/3  1/2 landed" in lines[-1]
