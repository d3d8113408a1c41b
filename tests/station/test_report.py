"""The report: whole in one file, the same each time, honest about what is missing."""

import argparse
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from synthetic_flight import Flight

from schemas import topics
from station import report_command
from station.flight_record import FlightRecord, Provenance, read_flight
from station.metrics.summary import summarise
from station.report.error import ReportError
from station.report.flight_path import flight_paths
from station.report.moments import moments
from station.report.write import write_report

VOID = {"meta", "img", "br", "use", "path", "rect", "circle", "line"}


class Structure(HTMLParser):
    """Checks that tags close in order, and collects texts and what is fetched from elsewhere."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.headings: list[str] = []
        self.fetched: list[str] = []

    def handle_starttag(self, tag, attrs):
        self.fetched += [v for k, v in attrs if k in ("src", "href") and v and not v.startswith(("data:", "#"))]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == "h2":
            self.headings.append(data)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return Flight(paint_every=6).write(tmp_path_factory.mktemp("flight"))


@pytest.fixture(scope="module")
def html(recording):
    record = read_flight(recording)
    path = recording.with_name("report.html")
    write_report(record, summarise(record), path)
    return path.read_text()


def structure_of(html: str) -> Structure:
    structure = Structure()
    structure.feed(html)
    assert structure.open == []
    return structure


def test_the_page_is_whole_and_fetches_nothing(html):
    structure = structure_of(html)
    assert structure.fetched == []
    assert "@import" not in html and "url(http" not in html
    assert structure.headings == [
        "Path", "Height and setpoints over time", "What the camera saw", "Error over height",
        "From the light to the setpoint", "In numbers", "Phases of the mission", "What became of each frame",
        "Incidents", "Services",
    ]  # fmt: skip


def test_the_page_says_what_happened(html):
    for text in ("Landed 3.6 cm from the pad&#x27;s centre after 14.4 s", "estimate within 0.10 m", "guidance glide",
                 "no_marker", "seed 7"):  # fmt: skip
        assert text in html


def test_pictures_follow_light_and_dark(html):
    drawings = re.findall(r"<svg.*?</svg>", html, flags=re.DOTALL)
    assert len(drawings) == 4
    for drawing in drawings:
        colours = set(re.findall(r"(?:fill|stroke): *([^;\"]+)", drawing))
        assert {colour for colour in colours if not colour.startswith("var(--")} <= {"none"}
    used = set(re.findall(r"var\((--[a-z-]+)\)", html))
    defined = set(re.findall(r"(--[a-z-]+):", html))
    assert used <= defined


def test_ids_inside_the_pictures_do_not_collide(html):
    drawings = re.findall(r"<svg.*?</svg>", html, flags=re.DOTALL)
    clips = [set(re.findall(r'<clipPath id="([^"]+)"', drawing)) for drawing in drawings]
    assert sum(len(ids) for ids in clips) == len(set().union(*clips))


def test_the_same_flight_is_the_same_page(recording, html):
    record = read_flight(recording)
    again = recording.with_name("again.html")
    write_report(record, summarise(record), again)
    assert again.read_text() == html


def test_five_moments_evenly_in_height_with_the_detection_drawn_in(recording):
    record = read_flight(recording)
    summary = summarise(record)
    shown = moments(record, summary, flight_paths(record, summary))
    heights_m = [float(re.search(r"([\d.]+) m up", moment.caption)[1]) for moment in shown]
    assert len(shown) == 5
    np.testing.assert_allclose(heights_m, np.linspace(heights_m[0], heights_m[-1], 5), atol=1.0)


@pytest.mark.parametrize(
    ("flight", "verdict", "headings"),
    [
        (
            Flight(abort_at_s=8.0),
            "The landing did not end on the ground: ended in aborted",
            {"Path", "Error over height"},
        ),
        (Flight(abort_at_s=1.0), "The descent never began: ended in aborted", {"Path", "Phases of the mission"}),
        (Flight(with_truth=False), "(by its own estimate)", {"Path", "In numbers"}),
        (Flight(commander_restarts_at_s=6.0), "Landed 3.6 cm", {"Incidents"}),
    ],
)
def test_other_flights_have_a_report_too(tmp_path, flight, verdict, headings):
    record = flight.record()
    write_report(record, summarise(record), tmp_path / "report.html")
    html = (tmp_path / "report.html").read_text()
    assert verdict in html
    assert "holds no picture" in html
    assert headings <= set(structure_of(html).headings)


def test_an_empty_recording_has_a_report_too(tmp_path):
    record = FlightRecord([], Provenance(defects=("flight.mcap was not finished",)))
    write_report(record, summarise(record), tmp_path / "report.html")
    html = (tmp_path / "report.html").read_text()
    assert "mission status is not in the recording" in html and "flight.mcap was not finished" in html


def test_words_from_the_flight_cannot_become_markup(tmp_path):
    flight = Flight(abort_at_s=8.0)
    entries = [(topic.name, logged) for topic in topics.TOPICS for logged in flight.record().logged(topic)]
    record = FlightRecord(entries, Provenance({"vehicle": "<script>alert(1)</script>"}, {"note": "</pre><b>"}))
    write_report(record, summarise(record), tmp_path / "report.html")
    html = (tmp_path / "report.html").read_text()
    assert "<script" not in html and "</pre><b>" not in html


def test_without_matplotlib_the_remedy_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("station.report.write.find_spec", lambda name: None)
    record = Flight(abort_at_s=1.0).record()
    with pytest.raises(ReportError, match=r"pip install 'alight\[report\]'"):
        write_report(record, summarise(record), tmp_path / "report.html")


def arguments(*texts: str):
    parser = argparse.ArgumentParser()
    report_command.add_arguments(parser)
    return parser.parse_args(texts)


def test_the_command_writes_beside_the_recording_and_prints_the_summary(recording, capsys):
    assert report_command.run(arguments(str(recording))) == 0
    said = capsys.readouterr().out
    assert said.startswith("landed 3.6 cm from the pad's centre after 14.4 s\n")
    assert f"report: {recording.with_suffix('.html')}" in said
    assert recording.with_suffix(".html").exists()


def test_the_command_names_a_missing_recording_in_one_line(tmp_path, capsys):
    assert report_command.run(arguments(str(tmp_path / "none.mcap"))) == 1
    assert (
        capsys.readouterr().err
        == f"{tmp_path / 'none.mcap'}: no such recording; give a flight's folder or its .mcap file\n"
    )
