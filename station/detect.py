"""`alight detect FILES`: what the detector sees in images and videos, by the very code that flies."""

import argparse
import functools
import json
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from alight.geometry.camera import PinholeCamera
from alight.markers.family import FamilyError, dictionary, dictionary_from_file
from alight.markers.layout import LayoutError
from schemas.settings import Settings
from schemas.settings.detector import Aruco
from services.camera.calibration_file import CalibrationError, read_calibration
from services.camera.files import FilesError, listed_files, pictures_in
from services.camera.picture_source import SourcedPicture
from services.detector.aided.backend import AidedBackend
from services.detector.aruco import ArucoBackend
from services.detector.charuco import NoChessboardError
from services.detector.detector import Detector, FoundMarker, GreyPicture, Prior, View
from services.detector.node import grey
from services.detector.registry import UnknownDetectorError, detector_from, detector_names
from services.detector.square_pose import located
from services.detector.yolo.model_error import ModelError
from station.detect_context import ContextError, PriorFor, read_context
from station.detect_drawing import draw_markers
from station.detect_table import table_lines

SizePx = tuple[int, int]

_PAPERS_FAMILY = "5x5_1000"
_DEFAULT_FAMILY = {"apriltag": "apriltag_36h11"}
_ANY_SIZE_PX = (640, 480)
_WHOLE_FAMILIES = ("apriltag",)
"""Detectors that give all markers of the pad's families, whichever the pad is."""
_WRONG_OPTIONS = (
    FamilyError,
    LayoutError,
    UnknownDetectorError,
    NoChessboardError,
    ModelError,
    ContextError,
    CalibrationError,
    FilesError,
)

CameraFor = Callable[[SizePx], PinholeCamera | None]


@dataclass(frozen=True)
class Looked:
    """What was seen in one picture."""

    file: Path
    frame: int | None
    """Its number in a video; None for an image."""
    size_px: SizePx
    markers: tuple[FoundMarker, ...]
    poses: tuple[Any, ...]
    """For each marker its `schemas.detection.Marker`, or None without a camera."""
    milliseconds: float


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe `alight detect`."""
    parser.add_argument("files", nargs="+", metavar="FILES", help="images, videos, directories or patterns")
    parser.add_argument(
        "--family",
        help="marker family, such as 5x5_1000 or apriltag_36h11 (default: 5x5_1000; with --detector apriltag: apriltag_36h11)",
    )
    parser.add_argument(
        "--dictionary", type=Path, metavar="FILE", help="a dictionary of your own (OpenCV YAML) instead of a family"
    )
    parser.add_argument("--id", type=int, metavar="N", help="only the marker with this number")
    parser.add_argument(
        "--size-m",
        type=_length_m,
        default=1.0,
        metavar="METRES",
        help="length of the marker's black outer edge (default: %(default)s)",
    )
    parser.add_argument(
        "--camera",
        type=Path,
        metavar="FILE",
        help="calibration (TOML or OpenCV YAML); without one there are corners, but no poses",
    )
    parser.add_argument(
        "--detector",
        default=None,
        metavar="NAME",
        help="which detector looks (default: aided for a known pad, given by --id or --pad; else aruco)",
    )
    parser.add_argument("--model", default="", metavar="FILE", help="the ONNX model of the detector yolo")
    parser.add_argument("--pad", metavar="LAYOUT", help="look for this pad: a shipped layout's name, or a TOML file")
    parser.add_argument(
        "--context",
        type=Path,
        metavar="FILE",
        help="what is known of each picture, as JSON lines: name and any of height_m, q_ned_camera, centre_px, ...",
    )
    parser.add_argument("--mirrored", action="store_true", help="the pictures are mirror images: flip them")
    parser.add_argument("--draw", type=Path, metavar="DIR", help="write pictures with the markers drawn in")
    parser.add_argument("--json", action="store_true", help="one line of JSON a picture instead of a table")


def run(arguments: argparse.Namespace) -> int:
    """Look at every picture; 0 if all could be read, 1 if not, 2 if the options cannot be used."""
    try:
        detector = _detector(arguments)
        camera_for = _camera_for(arguments.camera)
        prior_for = read_context(arguments.context)
        files = listed_files(arguments.files)
        if arguments.draw is not None:
            arguments.draw.mkdir(parents=True, exist_ok=True)
    except _WRONG_OPTIONS as error:
        return _refuse(str(error))
    except OSError as error:
        return _refuse(f"--draw {arguments.draw}: {error.strerror}")
    complaints: list[str] = []
    looked = _look(files, arguments, detector, camera_for, prior_for, complaints)
    if arguments.json:
        for each in looked:
            print(json.dumps(_as_json(each)), flush=True)
    else:
        for line in table_lines(looked):
            print(line, flush=True)
        if arguments.camera is None:
            print("no poses: they need the camera's calibration (--camera FILE)")
    for complaint in dict.fromkeys(complaints):
        print(f"alight detect: {complaint}", file=sys.stderr)
    return 1 if complaints else 0


def _look(
    files: list[Path],
    arguments: argparse.Namespace,
    detector: Detector,
    camera_for: CameraFor,
    prior_for: PriorFor,
    complaints: list[str],
) -> Iterator[Looked]:
    for file in files:
        for picture in pictures_in(file, mirrored=arguments.mirrored):
            if picture is None:
                complaints.append(f"{file}: not an image or video that can be decoded")
                continue
            size_px = (picture.pixels.shape[1], picture.pixels.shape[0])
            try:
                camera = camera_for(size_px)
            except CalibrationError as error:
                complaints.append(f"{file}: {error}")
                camera = None
            looked = _look_at(picture, file, detector, camera, prior_for(file, picture.frame), arguments)
            if arguments.draw is not None:
                draw_markers(picture.pixels, looked.markers, arguments.draw / _drawn_name(looked))
            yield looked


def _look_at(
    picture: SourcedPicture,
    file: Path,
    detector: Detector,
    camera: PinholeCamera | None,
    prior: Prior | None,
    arguments: argparse.Namespace,
) -> Looked:
    began_s = time.perf_counter()
    seen: GreyPicture = grey(picture.pixels)
    markers = tuple(
        marker
        for marker in detector.detect(View(seen, 0, camera, prior))
        if arguments.id is None or marker.id == arguments.id
    )
    poses = tuple(located(marker, arguments.size_m, camera) if camera else None for marker in markers)
    took_ms = (time.perf_counter() - began_s) * 1e3
    size_px = (seen.shape[1], seen.shape[0])
    return Looked(file, picture.frame, size_px, markers, poses, took_ms)


def _detector(arguments: argparse.Namespace) -> Detector:
    name = arguments.detector or ArucoBackend.name
    if name not in detector_names():
        raise UnknownDetectorError(f"--detector: no detector {name!r}: there are: {', '.join(detector_names())}")
    family = (arguments.family or _DEFAULT_FAMILY.get(name, _PAPERS_FAMILY)).lower()
    if arguments.dictionary is not None:
        if name != ArucoBackend.name:
            raise UnknownDetectorError(f"--dictionary is for --detector {ArucoBackend.name} only")
        return ArucoBackend(dictionary_from_file(arguments.dictionary), arguments.dictionary.stem, Aruco())
    if arguments.pad is None and arguments.id is None:
        if name == ArucoBackend.name:
            return ArucoBackend(dictionary(family), family, Aruco())
        if name not in _WHOLE_FAMILIES:
            raise UnknownDetectorError(f"--detector {name} looks for a known pad: give --id or --pad")
    single = {"family": family, "id": arguments.id or 0, "side_m": arguments.size_m}
    pad = {"layout": arguments.pad} if arguments.pad is not None else single
    chosen = {"backend": arguments.detector or AidedBackend.name, "yolo": {"model": arguments.model}}
    return detector_from(Settings.model_validate({"pad": pad, "detector": chosen}))


def _camera_for(path: Path | None) -> CameraFor:
    """How to get the camera for a size of picture; OpenCV's YAML often leaves out for which size it holds."""
    if path is None:
        return lambda _size_px: None
    read_calibration(path, "--camera", _ANY_SIZE_PX)  # a wrong file shows before the first picture

    @functools.cache
    def camera(size_px: SizePx) -> PinholeCamera:
        calibration = read_calibration(path, "--camera", size_px)
        believed = (calibration.width_px, calibration.height_px)
        if believed != size_px:
            raise CalibrationError(
                f"{size_px[0]}x{size_px[1]}, but {path} is for {believed[0]}x{believed[1]}: no poses"
            )
        return PinholeCamera.from_calibration(calibration)

    return camera


def _as_json(looked: Looked) -> dict[str, Any]:
    line: dict[str, Any] = {"name": str(looked.file)}
    if looked.frame is not None:
        line["frame"] = looked.frame
    line["width_px"], line["height_px"] = looked.size_px
    line["milliseconds"] = round(looked.milliseconds, 3)
    line["detections"] = [
        {
            "family": marker.family,
            "id": marker.id,
            "corners_px": [[round(x, 3), round(y, 3)] for x, y in marker.corners_px.tolist()],
            "corner_sigma_px": round(marker.corner_sigma_px, 4),
            "poses": [] if pose is None else [each.model_dump() for each in pose.poses],
        }
        for marker, pose in zip(looked.markers, looked.poses, strict=True)
    ]
    return line


def _drawn_name(looked: Looked) -> str:
    number = "" if looked.frame is None else f"_{looked.frame:06d}"
    return f"{looked.file.stem}{number}.png"


def _length_m(text: str) -> float:
    try:
        length_m = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no length in metres") from None
    if not 0.0 < length_m <= 100.0:
        raise argparse.ArgumentTypeError("must be more than 0 and at most 100 m")
    return length_m


def _refuse(reason: str) -> int:
    print(f"alight detect: {reason}", file=sys.stderr)
    return 2
