"""The detectors that the benches compare, all on the same pictures."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from alight.runtime.clock import NS_PER_S
from schemas.settings import Settings
from services.detector.detector import Detector, FoundMarker, View
from services.detector.registry import detector_from
from station.bench.detection_scene import Shot, Studio

Looking = Callable[[Studio, Shot], FoundMarker | None]


@dataclass(frozen=True)
class Contender:
    """A detector, told as much as its name says."""

    name: str
    look: Looking


class PlainOpenCV:
    """OpenCV's detector as it comes, with or without its own sub-pixel corners."""

    name = "OpenCV"

    def __init__(self, *, subpixel: bool) -> None:
        parameters = cv2.aruco.DetectorParameters()
        if subpixel:
            parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._opencv = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_1000), parameters)

    def detect(self, view: View) -> tuple[FoundMarker, ...]:
        """All markers of the family."""
        corners, ids, _ = self._opencv.detectMarkers(view.picture)
        if ids is None:
            return ()
        pairs = zip(np.ravel(ids), corners, strict=True)
        return tuple(
            FoundMarker("5x5_1000", int(number), np.asarray(four, float).reshape(4, 2), 0.5) for number, four in pairs
        )


class _Clock:
    """Frames so far apart that nobody tracks."""

    def __init__(self) -> None:
        self._now_ns = 0

    def next_ns(self) -> int:
        self._now_ns += 10 * NS_PER_S
        return self._now_ns


def contenders(model: str = "") -> list[Contender]:
    """OpenCV's default first, then the backends, each with all that it can be told; `yolo` only with a model, an ONNX file."""
    clock = _Clock()

    def alone(detector: Detector | PlainOpenCV) -> Looking:
        return lambda _studio, shot: _pad(detector.detect(View(shot.picture, clock.next_ns(), shot.camera)))

    def told(detector: Detector, *, place: bool) -> Looking:
        return lambda studio, shot: _pad(
            detector.detect(View(shot.picture, clock.next_ns(), shot.camera, studio.prior(shot, place=place)))
        )

    aided = backend("aided")
    rivals = [
        Contender("OpenCV default", alone(PlainOpenCV(subpixel=False))),
        Contender("OpenCV SUBPIX", alone(PlainOpenCV(subpixel=True))),
        Contender("aruco", alone(backend("aruco"))),
        Contender("aided: layout", alone(aided)),
        Contender("aided: + height, attitude", told(aided, place=False)),
        Contender("aided: + place", told(aided, place=True)),
    ]
    if model:
        yolo = backend("yolo", model)
        rivals += [
            Contender("yolo: layout", alone(yolo)),
            Contender("yolo: + height, attitude", told(yolo, place=False)),
        ]
    return rivals


def backend(name: str, model: str = "") -> Detector:
    """One of our own, looking for the paper's pad; `yolo` with that model."""
    return detector_from(Settings.model_validate({"detector": {"backend": name, "yolo": {"model": model}}}))


def _pad(found: tuple[FoundMarker, ...]) -> FoundMarker | None:
    return next((marker for marker in found if marker.id == 68), None)
