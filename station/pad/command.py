"""`alight pad`: print pads and look at them."""

import argparse
import sys
from pathlib import Path

from alight.geometry.camera import PinholeCamera
from alight.markers.family import FamilyError
from alight.markers.layout import LayoutError, PadLayout, read_layout, shipped_layouts
from schemas.settings.camera import CameraSettings
from services.camera.calibration_file import CalibrationError, configured_calibration, read_calibration
from station.pad.drawing import draw_layout
from station.pad.ranges import range_lines
from station.pad.tiling import PAPERS_MM, tiling


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe `alight pad print` and `alight pad show`."""
    actions = parser.add_subparsers(title="actions", metavar="ACTION", required=True)
    printing = actions.add_parser("print", help="write a PDF at true scale", description="Write a PDF at true scale.")
    _add_layout(printing)
    printing.add_argument("--paper", choices=tuple(PAPERS_MM), default="A3", help="default: %(default)s")
    printing.add_argument(
        "--overlap-mm",
        type=float,
        default=10.0,
        metavar="MM",
        help="strip of each sheet for the next one to lie on (default: %(default)g)",
    )
    printing.add_argument("--out", type=Path, required=True, metavar="FILE", help="the PDF")
    printing.set_defaults(run=run_print)
    showing = actions.add_parser(
        "show", help="list its markers and draw it", description="List a pad's markers, and draw it."
    )
    _add_layout(showing)
    showing.add_argument("--out", type=Path, metavar="PNG", help="draw it into this file")
    showing.add_argument(
        "--camera", type=Path, metavar="FILE", help="calibration to compute ranges for (default: the paper's)"
    )
    showing.set_defaults(run=run_show)


def run_print(arguments: argparse.Namespace) -> int:
    """Write the PDF; the exit status."""
    try:
        from station.pad.pdf import hints, write_pdf  # noqa: PLC0415 - needs the extra `print`
    except ModuleNotFoundError as error:
        return _refuse(f"printing needs {error.name}: pip install 'alight[print]'")
    try:
        layout = read_layout(arguments.layout)
        cut = tiling(1000.0 * layout.board_m, arguments.paper, arguments.overlap_mm)
        write_pdf(layout, cut, arguments.paper, arguments.out)
    except (LayoutError, FamilyError, ValueError) as error:
        return _refuse(str(error))
    except OSError as error:
        return _refuse(f"--out {arguments.out}: {error.strerror}")
    sheets = len(cut.tiles)
    print(
        f"{arguments.out}: {sheets} sheet{'s' if sheets > 1 else ''} of {arguments.paper} ({cut.rows} x {cut.columns})"
    )
    for hint in hints(layout, cut, arguments.paper):
        print(f"- {hint}")
    return 0


def run_show(arguments: argparse.Namespace) -> int:
    """Print the table, draw the picture; the exit status."""
    try:
        layout = read_layout(arguments.layout)
        if arguments.camera is not None:
            calibration = read_calibration(arguments.camera, "--camera")
        else:
            calibration = configured_calibration(CameraSettings())
    except (LayoutError, CalibrationError) as error:
        return _refuse(str(error))
    _print_table(layout)
    for line in range_lines(layout, PinholeCamera.from_calibration(calibration)):
        print(line)
    if arguments.out is not None and not draw_layout(layout, arguments.out):
        return _refuse(f"--out {arguments.out}: cannot be written as a picture")
    return 0


def _add_layout(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "layout",
        metavar="LAYOUT",
        help=f"{', '.join(f'`{name}`' for name in shipped_layouts())}, or a TOML file of your own",
    )


def _print_table(layout: PadLayout) -> None:
    print(f"pad {layout.name}: {len(layout.markers)} markers on a board of {layout.board_m:g} m")
    print(f"{'family':<16}{'id':>5}{'side, m':>10}{'x, m':>10}{'y, m':>10}{'turned, deg':>13}")
    for marker in layout.markers:
        turned_deg = marker.rotation_rad * 57.29577951308232
        print(
            f"{marker.family:<16}{marker.id:>5}{marker.side_m:>10.4g}{marker.x_m:>10.4f}{marker.y_m:>10.4f}{turned_deg:>13.1f}"
        )


def _refuse(reason: str) -> int:
    print(f"alight pad: {reason}", file=sys.stderr)
    return 2
