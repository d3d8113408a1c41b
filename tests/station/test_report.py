"""The report: whole in one file, the same each time, honest about what is missing."""

import argparse
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from mcap.writer import MCAP0_MAGIC
from synthetic_flight import RAW_ERROR_PER_M, Flight

from schemas import topics
from schemas.fix import FixVerdict
from schemas.settings import Settings
from station import report_command
from station.flight_record import FlightRecord, Provenance, read_flight
from station.metrics.summary import summarise
from station.report.configuration import differences
from station.report.error import ReportError
from station.report.flight_path import flight_paths
from station.report.health_cards import health_cards
from station.report.moments import moments
from station.report.page import pictures
from station.report.palette import DARK, LIGHT
from station.report.svg import texts_outside, texts_overlapping
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
    assert report_command.run(arguments(str(recording))) == 0
    return recording.with_suffix(".html").read_text()


def arguments(*texts: str):
    parser = argparse.ArgumentParser()
    report_command.add_arguments(parser)
    return parser.parse_args(texts)


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
        "Path", "Height and setpoints over time", "Phases of the mission", "What the camera saw",
        "What became of each fix", "Uncertainty against error", "Error over height", "In numbers",
        "From the light to the setpoint", "Services", "Incidents", "Configuration",
    ]  # fmt: skip


def test_the_page_says_what_happened(html):
    for text in ("Landed 3.6 cm from the pad&#x27;s centre after 15.0 s", "time to land (paper, Eq. 30)",
                 "True time to land", "estimate within 0.10 m", "guidance glide", "no_marker", "seed 7"):  # fmt: skip
        assert text in html


def test_pictures_follow_light_and_dark(html):
    drawings = re.findall(r"<svg.*?</svg>", html, flags=re.DOTALL)
    assert len(drawings) > 12
    for drawing in drawings:
        colours = set(re.findall(r"(?:fill|stroke)[:=] *\"?([^;\"]+)", drawing))
        assert {colour for colour in colours if not colour.startswith("var(--")} <= {"none"}
    used = set(re.findall(r"var\((--[a-z-]+)\)", html))
    defined = set(re.findall(r"(--[a-z-]+):", html))
    assert used <= defined


def test_every_fix_has_a_stroke_and_a_line(recording, html):
    record = read_flight(recording)
    part = summarise(record).landing
    fixes = [
        f for f in record.messages(topics.PAD_FIX) if part.looking_since_ns <= f.captured_at_ns <= part.ended_at_ns
    ]
    broad = re.search(r'<div class="broad"><svg[^>]*aria-label="Each fix.*?</svg>', html, flags=re.DOTALL)[0]
    lanes = re.findall(r'<g id="fixes [^"]*">\s*<path d="([^"]*)"', broad)
    assert sum(lane.count("M") for lane in lanes) == len(fixes)
    assert f"All {len(fixes)} fixes, one a line" in html
    listed = re.search(r"one a line</summary><pre>(.*?)</pre>", html, flags=re.DOTALL)[1].splitlines()
    assert len(listed) == len(fixes)
    assert sum("no_marker (no 5x5_1000 id 68 among 0 markers)" in line for line in listed) == sum(
        fix.verdict is FixVerdict.NO_MARKER for fix in fixes
    )


@pytest.mark.parametrize("narrow", [False, True])
def test_no_label_is_cut_or_covered(recording, narrow):
    record = read_flight(recording)
    for picture in pictures(record, summarise(record)):
        with picture.drawn(narrow=narrow) as drawn:
            assert (picture.name, texts_outside(drawn)) == (picture.name, [])
            assert (picture.name, texts_overlapping(drawn)) == (picture.name, [])


@pytest.mark.parametrize("scheme", [LIGHT, DARK])
def test_colours_stand_out_from_their_ground(scheme):
    for ground in (scheme.card, scheme.paper):
        for text in (scheme.ink, scheme.muted, scheme.estimate, scheme.bad_text):
            assert contrast(text, ground) >= 4.5
        for name in ("truth", "navigated", "setpoint", "raw", "corrected", "estimate", "camera", "bad", "good"):
            assert contrast(getattr(scheme, name), ground) >= 3.0, name
    for verdict in (scheme.good, scheme.bad):
        assert contrast(scheme.on_verdict, verdict) >= 4.5


def contrast(one: str, other: str) -> float:
    """WCAG 2.2, contrast ratio."""

    def luminance(colour: str) -> float:
        parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
        red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
        return 0.2126 * red + 0.7152 * green + 0.0722 * blue

    lighter, darker = sorted((luminance(one), luminance(other)), reverse=True)
    return (lighter + 0.05) / (darker + 0.05)


def test_ids_inside_the_pictures_do_not_collide(html):
    drawings = re.findall(r"<svg.*?</svg>", html, flags=re.DOTALL)
    clips = [set(re.findall(r'<clipPath id="([^"]+)"', drawing)) for drawing in drawings]
    assert sum(len(ids) for ids in clips) == len(set().union(*clips))


def test_five_moments_evenly_in_height_with_the_detection_drawn_in(recording):
    record = read_flight(recording)
    summary = summarise(record)
    shown = moments(record, summary, flight_paths(record, summary))
    heights_m = [float(re.search(r"([\d.]+) m up", moment.caption)[1]) for moment in shown]
    assert len(shown) == 5
    np.testing.assert_allclose(heights_m, np.linspace(heights_m[0], heights_m[-1], 5), atol=1.0)


def test_estimate_and_truth_are_drawn_where_the_pad_is_seen(recording):
    record = read_flight(recording)
    summary = summarise(record)
    shown = moments(record, summary, flight_paths(record, summary))
    # The made-up fixes have a raw error that the made-up pictures do not show; off the picture's middle its height counts, too.
    off_px = 293.0 * RAW_ERROR_PER_M * np.hypot(1.0, 0.5)
    for moment in shown:
        by_estimate_px, by_truth_px = moment.off_px
        assert by_truth_px == pytest.approx(0.0, abs=0.1)
        assert by_estimate_px == pytest.approx(off_px, abs=5.0)
    assert "truth 0.0 px off" in shown[-1].caption


def test_settings_that_differ_come_with_their_defaults():
    standard = Settings().filter
    assert differences({"seed": 7, "filter": {"method": standard.method, "window_length": 9}, "gone": {"key": 1}}) == [
        ("seed", "7", "0"),
        ("filter.window_length", "9", str(standard.window_length)),
        ("gone.key", "1", "unknown"),
    ]
    assert differences(Settings().model_dump(mode="json")) == []


def test_a_flight_without_truth_and_pictures_has_a_report_that_says_so(tmp_path):
    record = Flight(with_truth=False).record()
    write_report(record, summarise(record), tmp_path / "report.html")
    html = (tmp_path / "report.html").read_text()
    assert "(by its own estimate)" in html and "holds no picture" in html and "there is no truth" in html
    headings = structure_of(html).headings
    assert "Uncertainty against error" in headings and "Error over height" not in headings


def test_a_restart_is_told_on_the_services_card():
    record = Flight(commander_restarts_at_s=6.0).record()
    summary = summarise(record)
    cards = re.findall(r"<article.*?</article>", health_cards(record, summary, flight_paths(record, summary)))
    assert {re.search("<h3>(.*?)</h3>", card)[1] for card in cards} == topics.SERVICES
    told = [card for card in cards if "restarted 1x (+4.0 s)" in card]
    assert len(told) == 1 and "<h3>commander</h3>" in told[0] and 'class="ill"' in told[0]


def test_an_empty_recording_has_a_report_too(tmp_path):
    record = FlightRecord([], Provenance(defects=("flight.mcap was not finished",)))
    write_report(record, summarise(record), tmp_path / "report.html")
    html = (tmp_path / "report.html").read_text()
    for text in ("mission status is not in the recording", "flight.mcap was not finished", "no fix in the recording",
                 "nothing of where the vehicle", "No service&#x27;s health", "holds no settings", "Neither a truth"):  # fmt: skip
        assert text in html.replace("No service's", "No service&#x27;s")


def test_words_from_the_flight_cannot_become_markup(tmp_path):
    flight = Flight(abort_at_s=1.0)
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


def test_the_command_prints_the_summary_and_where_the_page_is(tmp_path, capsys):
    page = tmp_path / "elsewhere" / "page.html"
    (tmp_path / "flight").mkdir()
    Flight(abort_at_s=1.0).write(tmp_path / "flight")
    assert report_command.run(arguments(str(tmp_path / "flight"), "--out", str(page))) == 0
    said = capsys.readouterr().out
    assert said.startswith("the descent never began: ended in aborted") and said.endswith(f"report: {page}\n")
    assert "The descent never began" in page.read_text()


def test_the_same_flight_is_the_same_picture(recording):
    record = read_flight(recording)
    first, again = (pictures(record, summarise(record))[0].html() for _ in range(2))
    assert first == again


def test_the_command_names_a_missing_recording_in_one_line(tmp_path, capsys):
    assert report_command.run(arguments(str(tmp_path / "none.mcap"))) == 1
    assert (
        capsys.readouterr().err
        == f"alight report: {tmp_path / 'none.mcap'}: no such recording; give a flight's folder or its .mcap file\n"
    )


@pytest.mark.parametrize("begun", [b"", MCAP0_MAGIC[:4], MCAP0_MAGIC])
def test_the_command_writes_no_page_of_a_recording_without_messages(tmp_path, capsys, begun):
    (tmp_path / "stub.mcap").write_bytes(begun)
    assert report_command.run(arguments(str(tmp_path / "stub.mcap"))) == 1
    said = capsys.readouterr()
    assert "stub.mcap: holds no messages" in said.err and said.err.count("\n") == 1 and not said.out
    assert not (tmp_path / "stub.html").exists()
