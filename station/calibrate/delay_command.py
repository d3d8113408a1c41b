"""`alight calibrate delay`: from recorded flights to the setting that says how much later than the light the stamps are."""

import argparse
import sys
from pathlib import Path

from station.biases.extrinsic_model import BelievedCamera
from station.delays.delay_fit import MAX_SIGMA_S, Delay, DelayError, Motion, check_agreement, fit_delay
from station.delays.recorded_motion import read_motion
from station.flight_record import read_flight
from station.mcap_parts import FlightRecordError

SETTING = "geolocator.lookup.image_latency_s"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe `alight calibrate delay`."""
    parser.add_argument(
        "recordings", nargs="+", type=Path, metavar="RECORDING", help="flights with the pad in view, any way flown"
    )


def run(arguments: argparse.Namespace) -> int:
    """Fit and print; 0 if the delay was found, 1 if the flights do not show it."""
    try:
        motions, camera = _read(arguments.recordings)
        each = [_alone(path, motion, camera) for path, motion in zip(arguments.recordings, motions, strict=True)]
        check_agreement([one for one in each if one is not None])
        together = fit_delay(motions, camera)
        if len(each) > 1:
            print(_row("all", together))
    except (DelayError, FlightRecordError, OSError) as error:
        print(f"alight calibrate delay: {error}", file=sys.stderr)
        return 1
    print(
        f"\nthe pictures are {1e3 * together.delay_s:.1f} ms older than their stamps (one sigma {1e3 * together.sigma_s:.1f} ms)"
    )
    print(
        f"\n[geolocator.lookup]\nimage_latency_s = {together.delay_s:.4f}\n\nor --set {SETTING}={together.delay_s:.4f}"
    )
    return 0


def _read(paths: list[Path]) -> tuple[list[Motion], BelievedCamera]:
    read = []
    for path in paths:
        try:
            read.append(read_motion(read_flight(path)))
        except DelayError as error:
            raise DelayError(f"{path}: {error}") from None
    cameras = {camera for _, camera in read}
    if len(cameras) > 1:
        raise DelayError("the recordings are of different cameras or mounts: give those of one")
    return [motion for motion, _ in read], read[0][1]


def _alone(path: Path, motion: Motion, camera: BelievedCamera) -> Delay | None:
    """What one recording says, printed; None if it shows nothing by itself."""
    try:
        delay = fit_delay([motion], camera, refuse=False)
    except DelayError as error:
        print(f"{path}: {error}")
        return None
    print(_row(str(path), delay))
    return delay


def _row(name: str, delay: Delay) -> str:
    remark = "" if delay.sigma_s <= MAX_SIGMA_S else "  shows little"
    return (
        f"{name}: {1e3 * delay.delay_s:.1f} ms, sigma {1e3 * delay.sigma_s:.1f} ms, {delay.frames} frames, "
        f"10 ms move the pad {delay.moved_px:.2f} px{remark}"
    )
