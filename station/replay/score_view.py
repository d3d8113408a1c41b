"""Horizontal errors of recorded and replayed estimates, one beside the other."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from station.replay.recording import ReplayRecording
from station.replay.result import ReplayResult
from station.replay.score import Scorer, Track
from station.report.picture import Picture
from station.report.svg import PAGE, dots


def score_picture(recording: ReplayRecording, result: ReplayResult) -> Picture | None:
    """Errors of the estimates over time and their distribution; None where there is nothing to measure against."""
    scorer = Scorer(recording)
    recorded, replayed = scorer.recorded_track(), scorer.replayed_track(result)
    if not (len(recorded.at_s) and len(replayed.at_s)):
        return None
    return Picture(
        "scores", "Errors of the estimates, recorded and replayed", 3.9, 6.6, partial(_draw, recorded, replayed)
    )


def _draw(recorded: Track, replayed: Track, drawn: Figure, narrow: bool) -> None:
    over_time, share = drawn.subplots(2, 1) if narrow else drawn.subplots(1, 2)
    for track, colour, name in ((recorded, PAGE.navigated, "recorded"), (replayed, PAGE.estimate, "replayed")):
        dots(over_time, track.at_s, 100 * track.error_m, 3.2, colour, name)
        _distribution(share, 100 * track.error_m, colour)
    over_time.set_title("Error of each estimate")
    over_time.set_xlabel("time since the first message [s]")
    over_time.set_ylabel("horizontal error [cm]")
    over_time.set_ylim(bottom=0)
    share.set_title("Share of estimates below an error")
    share.set_xlabel("horizontal error [cm]")
    share.set_ylabel("share [%]")
    handles, labels = over_time.get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside lower center", ncols=2)


def _distribution(axes: Axes, errors_cm: NDArray[np.float64], colour: str) -> None:
    axes.step(np.sort(errors_cm), 100 * np.arange(1, len(errors_cm) + 1) / len(errors_cm), where="post", color=colour)
