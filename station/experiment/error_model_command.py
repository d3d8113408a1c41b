"""`alight experiment error-model`: the paper's static hovers, flown, fitted and put beside what it published."""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from alight.runtime.settings_file import SettingsError
from station.biases.cylindrical_fit import FitError
from station.biases.recorded_hover import RecordedHover, read_hover
from station.biases.study import Study, study_of
from station.biases.tables import study_lines
from station.count_progress import CountProgress
from station.experiment.generalisation import generalisation_lines, generalise
from station.experiment.hover_flights import fly_hovers
from station.experiment.hover_plan import HoverPlace, other_places, paper_places
from station.flight_record import read_flight
from station.mcap_parts import FlightRecordError

FIT_SEED, TEST_SEED = 1, 1001
TEST_SAMPLES = 100


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe `alight experiment error-model`."""
    parser.add_argument("--samples", type=int, default=1000, metavar="N", help="of each record (default: %(default)s)")
    parser.add_argument(
        "--generalise", action="store_true", help="test the fits at other heights, headings and tilts, too"
    )
    parser.add_argument(
        "--jobs", type=int, default=1, metavar="N", help="hovers flown at a time (default: %(default)s)"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("error-model"), metavar="DIR",
        help="where recordings, corrections and figures go; hovers that are there already are not flown again",
    )  # fmt: skip
    parser.add_argument(
        "--set", action="append", default=[], metavar="SECTION.KEY=VALUE", help="set one key; repeatable"
    )


def run(arguments: argparse.Namespace) -> int:
    """Fly, fit, print, draw; the exit status."""
    from station.calibrate.bias_command import write_study  # noqa: PLC0415 - without matplotlib --help still works
    from station.report.error import ReportError  # noqa: PLC0415

    try:
        if arguments.samples < 20 or arguments.jobs < 1:
            raise SettingsError("--samples: at least 20; --jobs: at least 1")
        hovers = _flown(paper_places(), arguments.samples, FIT_SEED, arguments)
        study = study_of(hovers)
        print("\n".join(study_lines(study)))
        print("\n".join(["", *injected_lines(study)]))
        write_study(study, arguments.out)
        if arguments.generalise:
            places = other_places()
            others = _flown(places, TEST_SAMPLES, TEST_SEED, arguments)
            print("\n".join(["", *generalisation_lines(generalise(study, places, others))]))
    except (FitError, FlightRecordError, ReportError, SettingsError, OSError) as error:
        sys.stderr.write(f"alight experiment error-model: {error}\n")
        return 1
    return 0


def injected_lines(study: Study) -> list[str]:
    """What was built wrongly beside what was found, with the attitude of the reference and with the autopilot's."""
    settings = study.hovers[0].settings
    wrong = settings.simulator.installation
    pairs = {
        "mount_roll_deg": wrong.mount_roll_deg,
        "mount_pitch_deg": wrong.mount_pitch_deg,
        "mount_yaw_deg": wrong.mount_yaw_deg,
        "focal_scale": wrong.lens_scale,
        "pad_scale": wrong.pad_scale,
        "pad_down_m": -settings.simulator.pad.height_above_home_m,
        "image_latency_s": wrong.image_latency_s,
        "pad_azimuth_deg": settings.simulator.pad.azimuth_deg,
        "pad_tilt_north_deg": 0.0,
        "pad_tilt_east_deg": 0.0,
    }
    fits = [fit for fit in (study.extrinsic, study.by_autopilot) if fit is not None]
    heads = ("found", "off by") if len(fits) == 1 else ("reference", "off by", "autopilot", "off by")
    lines = [f"{'injected and found':<20}{'injected':>10}" + "".join(f"{head:>11}" for head in heads)]
    for name, value in pairs.items():
        cells = [number for fit in fits for number in (fit.value(name), fit.value(name) - value)]
        lines.append(f"{name:<20}{value:>10.4f}" + "".join(f"{cell:>11.4f}" for cell in cells))
    return [*lines, *_compass_lines(study)]


def _compass_lines(study: Study) -> list[str]:
    """What a fit with the autopilot's attitude cannot know: by how much its headings were off in the mean."""
    errors_deg = [error[:, 2].mean() for hover in study.hovers if (error := hover.attitude_error_deg()) is not None]
    if not errors_deg:
        return []
    return [
        f"the autopilot's heading is off by {np.mean(errors_deg):+.3f} deg in the mean of the recordings, by {np.std(errors_deg):.2f} from one to",
        "the next: level hovers show the sum of that mean and the mount's yaw, and nothing in them tells the two apart",
    ]


def _flown(places: Sequence[HoverPlace], samples: int, seed: int, arguments: argparse.Namespace) -> list[RecordedHover]:
    folders = fly_hovers(
        places,
        samples,
        seed,
        arguments.out / "flights",
        os.environ,
        arguments.set,
        jobs=arguments.jobs,
        on_flown=CountProgress("hovers flown", len(places)).show,
    )
    return [read_hover(read_flight(folder), None, samples) for folder in folders]
