"""`alight calibrate bias`: from recorded hovers to the correction that the geolocator applies."""

import argparse
import math
import shutil
import sys
from pathlib import Path

from alight.runtime.settings_file import SettingsError
from schemas.message import GlobalPosition
from station.biases.cylindrical_fit import FitError
from station.biases.recorded_hover import RecordedHover, read_hover
from station.biases.study import Study, study_of
from station.biases.tables import study_lines
from station.flight_record import read_flight
from station.mcap_parts import FlightRecordError
from station.out_folder import make_folder

CORRECTION = "correction.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe `alight calibrate bias`."""
    parser.add_argument(
        "recordings", nargs="+", type=Path, metavar="RECORDING", help="hovers in view of the pad, one each"
    )
    parser.add_argument(
        "--model",
        choices=("cylindrical", "extrinsic"),
        default="extrinsic",
        help="which becomes correction.toml: the paper's biases, or what causes them (default: %(default)s)",
    )
    parser.add_argument(
        "--centre", choices=("mean", "median"), default="mean", help="of --model cylindrical (default: %(default)s)"
    )
    parser.add_argument(
        "--pad-at",
        type=_place,
        metavar="LAT,LON,HEIGHT",
        help="where the pad was surveyed, degrees and ellipsoidal metres: the reference is then the navigation solution",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("bias"), metavar="DIR", help="where to write (default: %(default)s)"
    )


def run(arguments: argparse.Namespace) -> int:
    """Fit and write; 0 if done, 1 if the hovers do not allow it."""
    from station.biases.write import correction_path  # noqa: PLC0415 - without matplotlib --help still works
    from station.report.error import ReportError  # noqa: PLC0415

    try:
        make_folder(arguments.out, f"--out {arguments.out}")
        hovers = [_read(path, arguments.pad_at) for path in arguments.recordings]
        study = study_of(hovers)
        print("\n".join(study_lines(study)))
        write_study(study, arguments.out)
    except (FitError, FlightRecordError, ReportError, SettingsError, OSError) as error:
        print(f"alight calibrate bias: {error}", file=sys.stderr)
        return 1
    variant = "extrinsic" if arguments.model == "extrinsic" else arguments.centre
    chosen = arguments.out / CORRECTION
    shutil.copyfile(correction_path(arguments.out, variant), chosen)
    print(f"\ncorrection {chosen}: use it with --set geolocator.correction_file={chosen}")
    return 0


def write_study(study: Study, out: Path) -> None:
    """Corrections of all variants, figures and the page."""
    from station.biases.write import write_corrections, write_figures, write_page  # noqa: PLC0415 - see `run`

    out.mkdir(parents=True, exist_ok=True)
    for path in write_corrections(study, out):
        print(f"\n{path}", end="")
    write_page(study, write_figures(study, out / "figures"), out / "report.html")
    print(f"\nreport {out / 'report.html'}, figures {out / 'figures'}")


def _read(path: Path, surveyed_pad: GlobalPosition | None) -> RecordedHover:
    try:
        return read_hover(read_flight(path), surveyed_pad)
    except FitError as error:
        raise FitError(f"{path}: {error}") from None


def _place(text: str) -> GlobalPosition:
    try:
        latitude_deg, longitude_deg, height_m = (float(word) for word in text.split(","))
        if not all(map(math.isfinite, (latitude_deg, longitude_deg, height_m))):
            raise ValueError(text)
        return GlobalPosition(
            latitude_deg=latitude_deg,
            longitude_deg=longitude_deg,
            altitude_amsl_m=height_m,
            ellipsoidal_height_m=height_m,
        )
    except ValueError:
        raise argparse.ArgumentTypeError("write LAT,LON,HEIGHT, such as 47.397742,8.545594,536.2") from None
