"""`alight calibrate delay`: from recorded flights to the setting that says how much later than the light the stamps are."""

import argparse
import sys
from pathlib import Path

from schemas.settings import Settings
from station.biases.extrinsic_model import BelievedCamera
from station.delays.delay_fit import MAX_SIGMA_S, Delay, DelayError, Motion, check_agreement, fit_delay
from station.delays.recorded_motion import flown_settings, read_motion
from station.flight_record import read_flight
from station.mcap_parts import FlightRecordError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe `alight calibrate delay`."""
    parser.add_argument(
        "recordings", nargs="+", type=Path, metavar="RECORDING", help="flights with the pad in view, any way flown"
    )


def run(arguments: argparse.Namespace) -> int:
    """Fit and print; 0 if the delay was found, 1 if the flights do not show it."""
    try:
        motions, camera, settings = _read(arguments.recordings)
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
    section, key, value = setting_for(settings, together.delay_s)
    print(f"\n[{section}]\n{key} = {value:.4f}\n\nor --set {section}.{key}={value:.4f}")
    print(f"\nthis is the whole and takes the place of what was set{besides(settings)}")
    return 0


def setting_for(settings: Settings, delay_s: float) -> tuple[str, str, float]:
    """Which setting undoes the delay: section, key and value.

    A live camera's stamps are put right where they are made; what was subtracted there already is still to be subtracted. For
    any other source the geolocator looks earlier, whatever it did in the recorded flights: the fit rests on the stamps alone.
    """
    if settings.camera.source in ("device", "stream"):
        return "camera.live", "delay_s", settings.camera.live.delay_s + delay_s
    return "geolocator.lookup", "image_latency_s", delay_s


def besides(settings: Settings) -> str:
    """What else to do, so that the delay is not undone twice; empty if nothing."""
    looked_earlier_s = settings.geolocator.lookup.image_latency_s
    if setting_for(settings, 0.0)[0] == "geolocator.lookup" or not looked_earlier_s:
        return ""
    return f"; take out geolocator.lookup.image_latency_s = {looked_earlier_s:g}, for both are subtracted"


def _read(paths: list[Path]) -> tuple[list[Motion], BelievedCamera, Settings]:
    read, settings = [], []
    for path in paths:
        record = read_flight(path)
        try:
            read.append(read_motion(record))
            settings.append(flown_settings(record))
        except DelayError as error:
            raise DelayError(f"{path}: {error}") from None
    cameras = {camera for _, camera in read}
    if len(cameras) > 1 or len({one.camera.live.delay_s for one in settings}) > 1:
        raise DelayError("the recordings are of different cameras, mounts or camera.live.delay_s: give those of one")
    return [motion for motion, _ in read], read[0][1], settings[0]


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
