"""Trajectories and time series of landings (the paper's Figures 14 and 15)."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from station.report.figures.static_records import Array
from station.report.figures.vector_file import COLUMN_IN, PAGE_IN, VectorFiles, print_figure, write_vector
from station.report.palette import LIGHT

_COLOURS = (LIGHT.estimate, LIGHT.setpoint, LIGHT.corrected, LIGHT.raw, LIGHT.camera, LIGHT.navigated)
_COORDINATES = (("north", 0, 1.0), ("east", 1, 1.0), ("height", 2, -1.0))


@dataclass(frozen=True)
class LandingTrack:
    """One landing as the autopilot logged it, which is what the paper shows."""

    mode: str
    """What is flown alike has the same, such as `bias correction, mean filter`."""
    t_s: Array
    """(N,), since the descent began, seconds."""
    ned_m: Array
    """(N, 3), from the pad's centre, north, east, down, metres."""
    setpoint_t_s: Array
    """(M,), seconds."""
    setpoint_ned_m: Array
    """(M, 3), metres."""


def modes(tracks: Sequence[LandingTrack]) -> list[str]:
    """The modes that were flown, in the order of the flights."""
    return list(dict.fromkeys(track.mode for track in tracks))


def trajectories(tracks: Sequence[LandingTrack], directory: Path) -> list[VectorFiles]:
    """Figure 14: the flights of each mode in space; `figure_14_trajectories_<number>.svg` and `.pdf`, one a mode."""
    files = []
    for number, mode in enumerate(modes(tracks), start=1):
        with print_figure(COLUMN_IN, COLUMN_IN) as drawn:
            axes: Any = drawn.add_subplot(projection="3d")
            for colour, track in zip(_repeated(len(tracks)), _of_mode(tracks, mode), strict=False):
                north_m, east_m, down_m = track.ned_m.T
                axes.plot(east_m, north_m, -down_m, color=colour, linewidth=1.0)
            axes.plot([0], [0], [0], "+", color=LIGHT.ink, markersize=9, markeredgewidth=1.6)
            axes.set_title(mode)
            axes.set_xlabel("east [m]")
            axes.set_ylabel("north [m]")
            axes.set_zlabel("height [m]")
            axes.set_box_aspect(None, zoom=0.88)
            files.append(write_vector(drawn, directory, f"figure_14_trajectories_{number}"))
    return files


def time_series(tracks: Sequence[LandingTrack], directory: Path) -> list[VectorFiles]:
    """Figure 15: north, east and height over time, the first flight of each mode; `figure_15_<coordinate>.svg` and `.pdf`.

    The dashed line is the pad; with the height, setpoints are dotted.
    """
    firsts = [_of_mode(tracks, mode)[0] for mode in modes(tracks)]
    files = []
    for name, column, sign in _COORDINATES:
        with print_figure(PAGE_IN, 2.6) as drawn:
            axes = drawn.subplots()
            for colour, track in zip(_repeated(len(firsts)), firsts, strict=False):
                axes.plot(track.t_s, sign * track.ned_m[:, column], color=colour, label=track.mode)
                if name == "height" and len(track.setpoint_t_s):
                    axes.plot(track.setpoint_t_s, -track.setpoint_ned_m[:, 2], ":", color=LIGHT.ink, linewidth=0.9)
            axes.axhline(0.0, color=LIGHT.ink, linewidth=0.9, linestyle="--", label="pad")
            axes.set_xlim(0, max(float(track.t_s[-1]) for track in firsts))
            axes.set_xlabel("time since the descent began [s]")
            axes.set_ylabel("height above the pad [m]" if name == "height" else f"{name} of the pad [m]")
            drawn.legend(loc="outside upper center", ncols=2)
            files.append(write_vector(drawn, directory, f"figure_15_{name}"))
    return files


def _of_mode(tracks: Sequence[LandingTrack], mode: str) -> list[LandingTrack]:
    return [track for track in tracks if track.mode == mode]


def _repeated(count: int) -> list[str]:
    return [str(colour) for colour in np.resize(np.array(_COLOURS), max(count, 1))]
