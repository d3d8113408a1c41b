"""The page over many flights: what is counted, what is drawn, what is linked."""

import argparse
import re

import numpy as np
import pytest
from synthetic_flight import Flight

from station import report_command
from station.report.campaign import campaign_page, write_campaign_report
from station.report.campaign_rows import ERROR_M, factors, recording_of, strength
from station.report.error import ReportError
from station.report.factor_view import factor_picture, measure_picture
from station.report.svg import texts_outside, texts_overlapping
from station.report.touchdown_view import touchdown_picture


def campaign(count: int = 80, **changes: object) -> list[dict[str, object]]:
    """Flights whose error grows with the wind; every tenth does not land."""
    random = np.random.default_rng(1)
    rows = []
    for index in range(count):
        wind, angle = float(random.uniform(0, 6)), float(random.uniform(0, 2 * np.pi))
        error_m, failed = 0.01 + 0.02 * wind, index % 10 == 9
        rows.append(
            {
                "index": index,
                "wind.speed_mps": wind,
                "start.height_m": float(random.uniform(10, 20)),
                "commander.guidance": ("glide", "reposition")[index % 2],
                "camera.simulated.sunlight": {"glare_level": 90.0 * (index % 2), "elevation_deg": 55.0},
                "outcome": "not_landed" if failed else "landed_on_pad",
                "landed": not failed,
                "reason": f"ended in hold, estimate_stale: {index / 10} s old" if failed else "",
                "touchdown_error_m": None if failed else error_m,
                "touchdown_north_m": None if failed else error_m * np.cos(angle),
                "touchdown_east_m": None if failed else error_m * np.sin(angle),
                "landing_s": None if failed else 20.0 + wind,
                "detection_rate": 0.9,
                "latency_p99_ms": 11.0 + index / 10,
            }
            | changes
        )
    return rows


@pytest.fixture(scope="module")
def html():
    return campaign_page(campaign(), {})


def test_the_headline_has_the_share_with_its_interval_and_the_failures_their_reasons(html):
    assert "72 of 80 flights landed on the pad: 90.0% (95 % interval 81.5% to 94.8%)" in html
    assert "not_landed: ended in hold, estimate_stale: # s old" in html
    assert "8 not_landed" in html and "first: 9" in html
    assert "None: every flight landed on the pad." in campaign_page([{"landed": True}] * 3, {})


def test_the_factor_that_matters_comes_first_and_what_is_constant_not_at_all():
    rows = campaign(**{"pad.side_m": 1.0})
    found = factors(rows)
    error_m = np.array([row[ERROR_M] or np.nan for row in rows])
    assert found[0].key == "wind.speed_mps"
    assert strength(found[0], error_m) == pytest.approx(1.0)
    assert {factor.key for factor in found} == {
        "wind.speed_mps", "start.height_m", "commander.guidance", "camera.simulated.sunlight",
    }  # fmt: skip
    sunlight = next(factor for factor in found if factor.key == "camera.simulated.sunlight")
    assert sunlight.levels == ("glare_level 0", "glare_level 90")


def test_a_factor_of_few_numbers_is_a_row_of_levels_in_their_order():
    rows = [{"delay_s": delay_s, ERROR_M: delay_s} for delay_s in (0.1, 0.05, 0.1, 0.0, 10.0)]
    (delay,) = factors(rows)
    assert delay.levels == ("0", "0.05", "0.1", "10")
    assert strength(delay, np.array([row[ERROR_M] for row in rows])) == pytest.approx(1.0)


@pytest.mark.parametrize(("count", "narrow"), [(3, True), (80, False), (80, True)])
def test_no_label_is_cut_or_covered(count, narrow):
    rows = campaign(count)
    for picture in (touchdown_picture(rows), factor_picture(rows), measure_picture(rows)):
        with picture.drawn(narrow=narrow) as drawn:
            assert (picture.name, texts_outside(drawn)) == (picture.name, [])
            if count > 3 or picture.name != "touchdown":
                assert (picture.name, texts_overlapping(drawn)) == (picture.name, [])


def test_every_touchdown_is_a_dot(html):
    broad = re.search(r'<div class="broad"><svg[^>]*aria-label="Horizontal error at.*?</svg>', html, flags=re.DOTALL)[0]
    assert re.search(r'<g id="dots landed">\s*<path d="([^"]*)"', broad)[1].count("M") == 72


def test_places_are_left_out_where_the_rows_have_none():
    rows = [
        {key: value for key, value in row.items() if "north" not in key and "east" not in key} for row in campaign()
    ]
    with touchdown_picture(rows).drawn(narrow=False) as drawn:
        assert len(drawn.axes) == 1


@pytest.mark.parametrize(
    "rows",
    [
        [{"index": 0, "landed": False, "outcome": "crashed", "reason": "out of memory"}],
        [{"landed": True}, {"landed": False}],
        [
            {
                "index": 7,
                "landed": True,
                "outcome": "landed_on_pad",
                "reason": None,
                "touchdown_error_m": 0.1,
                "wind": 1.0,
            }
        ],
    ],
)
def test_sparse_rows_have_a_page_too(rows):
    html = campaign_page(rows, {})
    assert f"of {len(rows)} flights landed" in html and "nan" not in re.sub(r"<svg.*?</svg>", "", html, flags=re.DOTALL)


def test_no_flights_no_page(tmp_path):
    with pytest.raises(ReportError, match="no flights"):
        write_campaign_report([], tmp_path)


def test_words_of_a_row_cannot_become_markup():
    row = dict.fromkeys(("reason", "outcome", "name"), "<script>") | {"landed": False}
    assert "<script" not in campaign_page([row, row | {"factor": "<script>"}], {0: '"><script>'})


def test_a_campaigns_recorded_flights_get_reports_that_are_linked(tmp_path):
    folder = tmp_path / "flights" / "000002"
    folder.mkdir(parents=True)
    Flight(abort_at_s=1.0).write(folder)
    page = write_campaign_report(campaign(3), tmp_path)
    assert page == tmp_path / "report.html"
    assert re.findall(r'href="([^#][^"]*)"', page.read_text()) == ["flights/000002/report.html"]
    assert "The descent never began" in (folder / "report.html").read_text()
    assert recording_of({"index": 1}, tmp_path) is None


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    """Two that are aborted, one of them before the descent."""
    root = tmp_path_factory.mktemp("flights")
    for name, flight in (("late", Flight(abort_at_s=4.0)), ("early", Flight(abort_at_s=1.0))):
        (root / name).mkdir()
        flight.write(root / name)
    return root


def test_several_flights_get_a_page_over_all_and_one_each(two, capsys):
    parser = argparse.ArgumentParser()
    report_command.add_arguments(parser)
    figures = two / "figures"
    arguments = parser.parse_args([str(two / "late"), str(two / "early"), "--figures", str(figures)])
    assert report_command.run(arguments) == 0
    html = (two / "flights.html").read_text()
    assert "0 of 2 flights landed on the pad: 0.0%" in html
    assert set(re.findall(r'href="([^#][^"]*)"', html)) == {"late/report.html", "early/report.html"}
    assert "The landing did not end on the ground: ended in aborted" in (two / "late" / "report.html").read_text()
    assert "The descent never began: ended in aborted" in (two / "early" / "report.html").read_text()
    assert f"report: {two / 'flights.html'}" in capsys.readouterr().out
    names = {path.name for path in figures.iterdir()}
    assert names == {
        f"{name}.{kind}"
        for name in ("figure_14_trajectories_1", "figure_15_north", "figure_15_east", "figure_15_height")
        for kind in ("svg", "pdf")
    }


def report(*words: object) -> int:
    parser = argparse.ArgumentParser()
    report_command.add_arguments(parser)
    return report_command.run(parser.parse_args([str(word) for word in words]))


def test_of_several_what_is_no_recording_is_left_out_and_named(two, tmp_path, capsys):
    empty, page = tmp_path / "20260101-000000", tmp_path / "flights.html"
    (empty / "logs").mkdir(parents=True)
    page.write_text("the page of before")
    assert report(empty, two / "late", page, two / "early", "--out", page) == 0
    assert "0 of 2 flights landed on the pad" in page.read_text()
    notes = capsys.readouterr().err.splitlines()
    assert notes == [f"note: {path} is no recording, and is left out" for path in (empty, page)]


def test_where_one_recording_is_left_it_gets_its_own_report(two, tmp_path, capsys):
    empty = tmp_path / "empty"
    empty.mkdir()
    assert report(empty, two / "early", "--out", tmp_path / "page.html") == 0
    assert capsys.readouterr().out.startswith("the descent never began")
    assert "The descent never began" in (tmp_path / "page.html").read_text()


def test_where_no_recording_is_left_or_one_is_missing_it_fails(two, tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    (tmp_path / "notes.txt").write_text("windy")
    assert report(tmp_path / "empty", tmp_path / "notes.txt") == 1
    assert "none of these is a recording" in capsys.readouterr().err.splitlines()[-1]
    assert report(two / "late", tmp_path / "lat") == 1
    assert f"{tmp_path / 'lat'}: no such recording" in capsys.readouterr().err


def test_what_is_no_page_is_refused_in_one_line(two, capsys):
    parser = argparse.ArgumentParser()
    report_command.add_arguments(parser)
    arguments = parser.parse_args([str(two / "late"), str(two / "late"), "--out", str(two / "folder")])
    assert report_command.run(arguments) == 1
    assert capsys.readouterr().err.endswith("name a page that ends in .html\n")
