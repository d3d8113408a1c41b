"""`alight calibrate camera`: from pictures of a board to the calibration file that every service reads."""

import argparse
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import cv2

from alight.runtime.bus import BusError
from alight.runtime.port import PortError
from alight.runtime.settings_file import SettingsError, load_settings
from schemas.settings.camera import Calibration
from services.camera.calibration_file import calibration_text, configured_calibration
from services.camera.files import VIDEO_SUFFIXES, FilesError, listed_files, pictures_in
from services.camera.simulated_camera import true_camera
from services.detector.node import grey
from station.calibrate import bias_command, delay_command
from station.calibrate.board import BoardError, CalibrationBoard, Grey, board_from
from station.calibrate.coverage import Coverage
from station.calibrate.judge import complaints_after, complaints_before
from station.calibrate.live import NoFramesError, live_pictures
from station.calibrate.looking import InputError, Looked, look_at_all, look_live
from station.calibrate.report import Outcome, parameter_lines, summary_lines, write_report
from station.calibrate.solve import NAMES, Solution, SolveError, solve
from station.calibrate.spiral import BOARD, spiral_pictures
from station.calibrate.views import choose_views
from station.commands import sentence

LIVE = "live"
CALIBRATION, COVERAGE, REPORT = "calibration.toml", "coverage.png", "report.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe `alight calibrate camera`, `alight calibrate bias` and `alight calibrate delay`."""
    actions = parser.add_subparsers(title="what", metavar="WHAT", required=True)
    meaning = "find a camera's intrinsic parameters from pictures of a board"
    camera = actions.add_parser("camera", help=meaning, description=sentence(meaning))
    camera.add_argument(
        "files",
        nargs="*",
        metavar="FILES",
        help="images, videos, directories or patterns; or the word `live` for the camera that runs now",
    )
    camera.add_argument(
        "--board",
        metavar="BOARD",
        help="chessboard:9x6:0.20 (inner corners, square in metres), charuco:5x7:0.04:0.02:6x6_250 (squares, square, marker, "
        "family; :legacy for boards of OpenCV before 4.6), or gridboard:5x7:0.033:0.0035:6x6_1000 (markers, side, gap, family)",
    )
    camera.add_argument(
        "--every", type=int, default=5, metavar="N", help="of a video, every Nth frame (default: %(default)s)"
    )
    camera.add_argument("--mirrored", action="store_true", help="the pictures are mirror images: flip them")
    camera.add_argument(
        "--simulated",
        action="store_true",
        help="no files: repeat the paper's spiral flight over its 9x6 board with the simulated camera",
    )
    camera.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="with --simulated or live: a setting, such as camera.source=device",
    )
    camera.add_argument(
        "--seconds",
        type=float,
        default=300.0,
        metavar="S",
        help="live: how long to look at most; Ctrl-C ends it, too (default: %(default)g)",
    )
    camera.add_argument(
        "--out", type=Path, default=Path("calibration"), metavar="DIR", help="where to write (default: %(default)s)"
    )
    camera.set_defaults(run=run)
    meaning = "find the installation's systematic error from recorded hovers above and beside the pad"
    bias = actions.add_parser("bias", help=meaning, description=sentence(meaning))
    bias_command.add_arguments(bias)
    bias.set_defaults(run=bias_command.run)
    meaning = "find from any flights above the pad how much later than the light the frames are stamped"
    delay = actions.add_parser("delay", help=meaning, description=sentence(meaning))
    delay_command.add_arguments(delay)
    delay.set_defaults(run=delay_command.run)


def run(arguments: argparse.Namespace) -> int:
    """Calibrate; 0 if the calibration is written, 1 if it is refused, 2 if the options cannot be used."""
    try:
        board, pictures, title = _input(arguments)
        out: Path = arguments.out
        if (out / CALIBRATION).exists():
            raise InputError(
                f"--out {out}: there is a calibration already, and none is overwritten; name another folder"
            )
        out.mkdir(parents=True, exist_ok=True)
        look = look_live if arguments.files == [LIVE] else look_at_all
        outcome = _calibrated(look(board, pictures, out / COVERAGE), out, title)
        write_report(outcome, out / COVERAGE, out / REPORT)
        if arguments.simulated and outcome.solution is not None:
            _compare(outcome.solution, arguments.set)
        return _conclude(outcome, out)
    except (BoardError, FilesError, InputError, NoFramesError, SettingsError, BusError, PortError) as error:
        print(f"alight calibrate: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"alight calibrate: --out {arguments.out}: {error.strerror}", file=sys.stderr)
        return 2


def _input(arguments: argparse.Namespace) -> tuple[CalibrationBoard, Iterator[tuple[str, Grey]], str]:
    if arguments.simulated:
        if arguments.files or arguments.board:
            raise InputError("--simulated: takes no files and no board of yours; leave them out")
        cv2.setNumThreads(1)  # sums would depend on the number of threads
        return BOARD, spiral_pictures(load_settings(None, os.environ, arguments.set)), "Simulated camera, spiral flight"
    if arguments.files == [LIVE] and arguments.board:
        settings = load_settings(None, os.environ, arguments.set)
        title = (
            f"{settings.camera.source if settings.camera.source in ('device', 'stream') else 'bus'}, {arguments.board}"
        )
        return board_from(arguments.board), live_pictures(settings, arguments.seconds), title
    if arguments.set:
        raise InputError("--set: only with --simulated or live")
    if not arguments.files or not arguments.board:
        raise InputError("name the pictures and the --board in them, or say --simulated")
    if arguments.every < 1:
        raise InputError("--every: must be at least 1")
    board = board_from(arguments.board)
    files = listed_files(arguments.files)
    return (
        board,
        _pictures(files, arguments.every, arguments.mirrored),
        f"{files[0].parent.name or files[0]}, {arguments.board}",
    )


def _pictures(files: list[Path], every: int, mirrored: bool) -> Iterator[tuple[str, Grey]]:
    for file in files:
        step = every if file.suffix.lower() in VIDEO_SUFFIXES else 1
        for number, picture in enumerate(pictures_in(file, mirrored=mirrored)):
            if picture is None:
                print(f"alight calibrate: {file}: not an image or video that can be decoded; skipped", file=sys.stderr)
            elif number % step == 0:
                yield picture.name, grey(picture.pixels)


def _calibrated(looked: Looked, out: Path, title: str) -> Outcome:
    """Choose, solve, judge."""
    views, count, size_px = looked
    chosen = choose_views(views)
    coverage = Coverage(size_px)
    coverage.add(chosen.used)
    coverage.draw(out / COVERAGE)
    complaints = list(complaints_before(count, len(views), chosen, coverage))
    solution: Solution | None = None
    try:
        if chosen.used:
            solution = solve(chosen.used, size_px)
            complaints += complaints_after(solution)
    except SolveError as error:
        complaints.append(str(error))
    return Outcome(title, count, len(views), chosen, coverage, solution, tuple(complaints))


def _compare(solution: Solution, assignments: list[str]) -> None:
    """The simulated camera's true numbers beside what was found."""
    settings = load_settings(None, os.environ, assignments)
    true = true_camera(configured_calibration(settings.camera), settings.simulator.installation.lens_scale)
    values = (true.fx_px, true.fy_px, true.cx_px, true.cy_px, *true.distortion.tolist())
    print(f"{'':<6} {'true':>11} {'found':>11} {'off by, standard deviations':>30}")
    for name, value, found, sigma in zip(
        NAMES, values, solution.values.tolist(), solution.sigmas.tolist(), strict=True
    ):
        print(f"{name:<6} {value:>11.5g} {found:>11.5g} {(found - value) / sigma:>30.1f}")


def _conclude(outcome: Outcome, out: Path) -> int:
    for line in summary_lines(outcome):
        print(line)
    print(f"report {out / REPORT}, coverage {out / COVERAGE}")
    if outcome.complaints or outcome.solution is None:
        for complaint in outcome.complaints:
            print(f"alight calibrate: refused: {complaint}", file=sys.stderr)
        return 1
    solution = outcome.solution
    remarks = [
        f"{outcome.title}; {len(solution.views)} views",
        f"reprojection error {solution.rms_px:.3f} px, over views left out in turn {solution.held_out_rms_px:.3f} px",
        *parameter_lines(solution),
    ]
    (out / CALIBRATION).write_text(calibration_text(as_calibration(solution, outcome.title), remarks), encoding="utf-8")
    print(f"calibration {out / CALIBRATION}: use it with --set camera.calibration_file={out / CALIBRATION}")
    return 0


def as_calibration(solution: Solution, source: str) -> Calibration:
    """The settings that describe the camera."""
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = solution.values.tolist()
    width, height = solution.size_px
    return Calibration(
        width_px=width,
        height_px=height,
        fx_px=fx,
        fy_px=fy,
        cx_px=cx,
        cy_px=cy,
        distortion=(k1, k2, p1, p2, k3),
        source=source[:500],
    )
