"""The detectors there are, by name."""

from collections.abc import Callable, Mapping
from importlib.metadata import entry_points

from alight.markers.family import dictionary
from alight.markers.layout import layout_from
from schemas.settings import Settings
from services.detector.aided.backend import AidedBackend
from services.detector.aruco import ArucoBackend
from services.detector.charuco import CharucoBackend
from services.detector.detector import Detector, WantedMarker
from services.detector.nested_aruco import NestedAruco


class UnknownDetectorError(ValueError):
    """A detector that does not exist, in one line with the remedy."""


def _aruco(settings: Settings) -> Detector:
    pad, layout = settings.pad, layout_from(settings.pad)
    if pad.layout:
        return NestedAruco(layout, settings.detector.aruco)
    return ArucoBackend(dictionary(pad.family), pad.family, settings.detector.aruco, WantedMarker(pad.family, pad.id))


def _aided(settings: Settings) -> Detector:
    return AidedBackend(layout_from(settings.pad), _aruco(settings))


def _apriltag(settings: Settings) -> Detector:
    try:
        from services.detector.apriltag import AprilTagBackend  # noqa: PLC0415 - needs the extra `apriltag`
    except ModuleNotFoundError as error:
        raise UnknownDetectorError(
            f"detector.backend: 'apriltag' needs {error.name}: pip install 'alight[apriltag]'"
        ) from None
    try:
        return AprilTagBackend(layout_from(settings.pad).families, settings.detector.apriltag)
    except OSError as error:
        raise UnknownDetectorError(
            f"detector.backend: 'apriltag': its library cannot be loaded on this machine: {error}"
        ) from None


def _yolo(settings: Settings) -> Detector:
    try:
        from services.detector.yolo.places import ModelPlaces  # noqa: PLC0415 - needs the extra `yolo`
    except ModuleNotFoundError as error:
        raise UnknownDetectorError(f"detector.backend: 'yolo' needs {error.name}: pip install 'alight[yolo]'") from None
    return AidedBackend(layout_from(settings.pad), _aruco(settings), ModelPlaces(settings.detector.yolo))


def _charuco(settings: Settings) -> Detector:
    return CharucoBackend(layout_from(settings.pad), settings.detector.aruco)


Builder = Callable[[Settings], Detector]

BACKENDS: Mapping[str, Builder] = {
    ArucoBackend.name: _aruco,
    AidedBackend.name: _aided,
    "apriltag": _apriltag,
    CharucoBackend.name: _charuco,
    "yolo": _yolo,
}
"""Our own: name in `detector.backend` to what builds it."""

ENTRY_POINTS = "alight.detectors"
"""The group of entry points in which an installed package names detectors: `name = "package.module:build"`."""


def detector_names() -> tuple[str, ...]:
    """All that may stand in `detector.backend`: our own and those of installed packages, sorted."""
    return tuple(sorted({*BACKENDS, *entry_points(group=ENTRY_POINTS).names}))


def detector_from(settings: Settings) -> Detector:
    """The detector that the settings name, looking for their pad. No package can take a name of ours.

    Raises:
        UnknownDetectorError: If there is none of that name, or its package is missing or cannot be loaded.
        FamilyError: If there is no such marker family, or the detector does not know it.
        ModelError: If the detector's model is missing or unfit.
        NoChessboardError: If the detector needs a chessboard and the pad has none.
    """
    name = settings.detector.backend
    build = BACKENDS[name] if name in BACKENDS else _installed(name)
    return build(settings)


def _installed(name: str) -> Builder:
    found = entry_points(group=ENTRY_POINTS, name=name)
    if not found:
        raise UnknownDetectorError(f"detector.backend: no detector {name!r}: there are: {', '.join(detector_names())}")
    entry = next(iter(found))
    try:
        build: Builder = entry.load()
    except Exception as error:  # a stranger's package may fail in any way
        raise UnknownDetectorError(f"detector.backend: {name!r} ({entry.value}) cannot be loaded: {error}") from None
    return build
