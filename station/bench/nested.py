"""Show 4: some marker of the pad `nested` in every frame from 0.15 m to 20 m, and where the pad's pose is then."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from alight.geometry.frames import CAMERA_IN_BODY_M
from alight.geometry.rotation import quaternion_from_euler
from alight.markers.layout import PadLayout, layout_from
from alight.runtime.clock import NS_PER_S
from alight.runtime.seed import generator
from schemas.message import GlobalPosition
from schemas.settings import Settings
from schemas.settings.pad import PadSettings
from schemas.truth import GroundTruth
from services.camera.calibration_file import configured_calibration
from services.camera.simulated_camera import SimulatedCamera
from services.camera.viewpoint import Viewpoint
from services.detector.board_pose import pad_view
from services.detector.detector import Detector, View
from services.detector.registry import detector_from
from services.detector.square_pose import located
from station.bench.table import print_table

FRAMES = 500
LOWEST_M, HIGHEST_M = 0.15, 20.0
OFFSET_M, OFFSET_PER_HEIGHT, TILT_RAD = 0.05, 0.1, math.radians(6.0)
BANDS_M = (0.15, 0.3, 0.6, 1.2, 2.5, 5.0, 10.0, 15.0, 20.0)

_SOMEWHERE = GlobalPosition(latitude_deg=47.4, longitude_deg=8.5, altitude_amsl_m=500.0, ellipsoidal_height_m=500.0)


@dataclass(frozen=True)
class Scene:
    """One picture of the pad, taken from anywhere above it."""

    height_m: float
    """Of the camera above the print."""
    picture: NDArray[np.uint8]
    centre_camera_m: NDArray[np.float64]
    """The pad's true centre in the camera's frame, (3,), metres."""


@dataclass(frozen=True)
class Seen:
    """What a detector made of a scene."""

    height_m: float
    markers: int
    """The pad's markers that were found."""
    strangers: int
    """Markers that are not there."""
    error: float
    """Distance between the pad's centre as located and as it is, as a part of its distance; NaN if it was not located."""


def bench_nested() -> None:
    """Show and print."""
    cv2.setNumThreads(1)
    settings = Settings(pad=PadSettings(layout="nested"))
    backends = tuple(dict.fromkeys((settings.detector.backend, "aided", "aruco")))
    looks: dict[str, list[Seen]] = {name: [] for name in backends}
    detectors = {
        name: detector_from(
            settings.model_copy(update={"detector": settings.detector.model_copy(update={"backend": name})})
        )
        for name in backends
    }
    camera = PinholeCamera.from_calibration(configured_calibration(settings.camera))
    layout = layout_from(settings.pad)
    for number, scene in enumerate(scenes(settings, FRAMES)):
        for name, detector in detectors.items():
            looks[name].append(look(detector, scene, layout, camera, number))
    for name in backends:
        _print(name, looks[name])


def scenes(settings: Settings, count: int) -> Iterator[Scene]:
    """Pictures from heights of which half are evenly spread and half on a logarithmic scale, the lowest and the highest included."""
    simulated = SimulatedCamera(settings, configured_calibration(settings.camera))
    random = generator(settings.seed, "bench.nested")
    near, far = np.geomspace(LOWEST_M, HIGHEST_M, count // 2), np.linspace(LOWEST_M, HIGHEST_M, count - count // 2)
    for height_m in np.sort(np.concatenate((near, far))).tolist():
        radius_m = (OFFSET_M + OFFSET_PER_HEIGHT * height_m) * math.sqrt(random.uniform())
        direction, tilt, towards, yaw = random.uniform(0.0, (math.tau, TILT_RAD, math.tau, math.tau))
        attitude = quaternion_from_euler(tilt * math.cos(towards), tilt * math.sin(towards), float(yaw))
        truth = GroundTruth(
            at_ns=NS_PER_S,
            vehicle_position=_SOMEWHERE,
            velocity_ned_mps=(0.0, 0.0, 0.0),
            q_ned_body=attitude,
            angular_velocity_body_rps=(0.0, 0.0, 0.0),
            pad_position=_SOMEWHERE,
            pad_azimuth_rad=0.0,
            vehicle_from_pad_ned_m=(
                radius_m * math.cos(direction),
                radius_m * math.sin(direction),
                -height_m - CAMERA_IN_BODY_M[2] * math.cos(tilt),
            ),
            touching_ground=False,
        )
        viewpoint = Viewpoint.from_truth(truth, np.eye(3))
        yield Scene(height_m, simulated.capture(truth), viewpoint.in_camera(np.zeros((1, 3)))[0])


def look(detector: Detector, scene: Scene, layout: PadLayout, camera: PinholeCamera, number: int) -> Seen:
    """Each frame on its own: ten seconds after the one before, so that nothing is tracked."""
    found = detector.detect(View(scene.picture, (number + 1) * 10 * NS_PER_S, camera))
    markers = []
    for each in found:
        placed = layout.find(each.family, each.id)
        if placed is not None and (marker := located(each, placed.side_m, camera)) is not None:
            markers.append(marker)
    pad = pad_view(markers, layout, camera)
    error = math.nan
    if pad is not None:
        off_m = [np.linalg.norm(np.array(pose.position_camera_m) - scene.centre_camera_m) for pose in pad.poses]
        error = float(off_m[0] / np.linalg.norm(scene.centre_camera_m))
    return Seen(scene.height_m, len(markers), len(found) - len(markers), error)


def _print(name: str, seen: list[Seen]) -> None:
    rows = []
    for low, high in itertools.pairwise(BANDS_M):
        band = [each for each in seen if low * 0.999 <= each.height_m < high * 1.001]
        errors = [each.error for each in band if not math.isnan(each.error)]
        rows.append(
            (
                f"{low:g} - {high:g} m",
                f"{sum(each.markers > 0 for each in band)} of {len(band)}",
                f"{np.mean([each.markers for each in band]):.1f}",
                str(sum(each.strangers for each in band)),
                f"{100 * float(np.median(errors)):.3f} %" if errors else "-",
            )
        )
    title = f"Pad `nested`, {name}, {len(seen)} frames, each on its own; offset to 0.05 m + 0.1 of the height, tilt to 6 deg, any yaw"
    print_table(title, ("camera above the print", "pad seen", "markers a frame", "false", "pose error, median"), rows)
    missed = [f"{each.height_m:.2f} m" for each in seen if not each.markers]
    print(
        f"seen in {len(seen) - len(missed)} of {len(seen)} frames" + (f"; not at {', '.join(missed)}" if missed else "")
    )
