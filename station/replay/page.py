"""A replay as a page: totals, the first divergence with its picture, differences over time, scores side by side."""

from collections.abc import Iterator
from html import escape
from pathlib import Path

from schemas.message import Traced
from station.replay.difference_view import difference_pictures
from station.replay.divergence_picture import divergence_picture
from station.replay.explanation import clock, explanation
from station.replay.recording import ReplayRecording
from station.replay.result import ReplayResult
from station.replay.score import Score
from station.replay.score_view import score_picture
from station.replay.text import remark_lines, verdict
from station.report.document import Section, banner, document

_HEADS = ("same", "tolerated", "different", "additional", "missing", "stand-in", "not compared")


def write_page(
    recording: ReplayRecording, result: ReplayResult, scores: tuple[Score, Score] | None, directory: Path
) -> Path:
    """Write `replay.html`, self-contained, into a folder; its path.

    Raises:
        OSError: If it cannot be written.
    """
    directory.mkdir(parents=True, exist_ok=True)
    path = directory / "replay.html"
    path.write_text(_page(recording, result, scores), encoding="utf-8")
    return path


def _page(recording: ReplayRecording, result: ReplayResult, scores: tuple[Score, Score] | None) -> str:
    heading = f"Replay of {recording.path.name}"
    return document(
        title=f"{heading}: {verdict(result)}",
        heading=heading,
        about="; ".join(
            [
                f"through {', '.join(result.services)}",
                *result.assignments,
                f"{result.flown_s:.1f} s",
                f"tolerances: {result.tolerances}",
            ]
        ),
        body=banner(verdict(result), good=result.equal)
        + _remarks(result)
        + "".join(section.html() for section in _sections(recording, result, scores)),
        version=recording.versions.get("alight", ""),
    )


def _sections(
    recording: ReplayRecording, result: ReplayResult, scores: tuple[Score, Score] | None
) -> Iterator[Section]:
    told = "\n".join(explanation(result))
    if told:
        content = f"<pre>{escape(told)}</pre>{_picture(recording, result)}"
        yield Section("First divergence", "Causes come before what they cause.", content)
    about = "What the nodes said in the replay beside what they said in flight."
    yield Section("Messages by topic", about, _counts(result))
    for picture in difference_pictures(result):
        about = (
            "Replayed minus recorded over the time of the flight: of each kind of quantity the field that differs most."
        )
        yield Section(f"Differences in {picture.name}", about, picture.html())
    if scores is not None:
        about = (
            f"Measured against {scores[0].reference}. Times are those of the flight: a replay says nothing of latency."
        )
        drawn = score_picture(recording, result)
        yield Section("What fixes and estimates were worth", about, (drawn.html() if drawn else "") + _scores(*scores))


def _picture(recording: ReplayRecording, result: ReplayResult) -> str:
    first = result.first_divergence
    if first is None or not isinstance(first.message, Traced):
        return ""
    captured_at_ns = first.message.captured_at_ns
    jpeg = divergence_picture(recording, result, captured_at_ns)
    if jpeg is None:
        return ""
    caption = f"The frame of {clock(captured_at_ns)}: green as recorded, magenta as replayed."
    image = f'<img alt="{escape(caption)}" src="data:image/jpeg;base64,{jpeg}">'
    return f'<div class="moments"><figure>{image}<figcaption>{escape(caption)}</figcaption></figure></div>'


def _counts(result: ReplayResult) -> str:
    head = "".join(f'<th class="number">{name}</th>' for name in _HEADS)
    rows = []
    for name, c in result.counts.items():
        numbers = (c.same, c.tolerated, c.different, c.additional, c.missing, c.stand_in, c.uncovered)
        cells = "".join(f'<td class="number">{number or "–"}</td>' for number in numbers)
        rows.append(f"<tr><td>{escape(name)}</td>{cells}</tr>")
    return f'<div class="wide"><table><tr><th>topic</th>{head}</tr>{"".join(rows)}</table></div>'


def _scores(recorded: Score, replayed: Score) -> str:
    rows = "".join(
        f'<tr><td>{escape(name)}</td><td class="number">{escape(one)}</td><td class="number">{escape(other)}</td></tr>'
        for (name, one), (_, other) in zip(recorded.rows(), replayed.rows(), strict=True)
    )
    head = '<tr><th>measure</th><th class="number">recorded</th><th class="number">replayed</th></tr>'
    return f'<div class="wide"><table>{head}{rows}</table></div>'


def _remarks(result: ReplayResult) -> str:
    remarks = "".join(f"<li>{escape(remark)}</li>" for remark in remark_lines(result))
    return f'<div class="defects">What keeps this replay from being exact:<ul>{remarks}</ul></div>' if remarks else ""
