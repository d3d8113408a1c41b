"""The detectors there are, by name."""

from collections.abc import Callable, Mapping

from alight.markers.family import dictionary
from alight.markers.layout import layout_from
from schemas.settings import Settings
from services.detector.aided.backend import AidedBackend
from services.detector.aruco import ArucoBackend
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
    whole_frame = settings.detector.model_copy(
        update={"aruco": settings.detector.aruco.model_copy(update={"track": False})}
    )
    return AidedBackend(layout_from(settings.pad), _aruco(settings.model_copy(update={"detector": whole_frame})))


BACKENDS: Mapping[str, Callable[[Settings], Detector]] = {ArucoBackend.name: _aruco, AidedBackend.name: _aided}
"""Name in `detector.backend` to what builds it."""


def detector_from(settings: Settings) -> Detector:
    """The detector that the settings name, looking for their pad.

    Raises:
        UnknownDetectorError: If there is none of that name.
        FamilyError: If there is no such marker family.
    """
    build = BACKENDS.get(settings.detector.backend)
    if build is None:
        there_are = ", ".join(sorted(BACKENDS))
        raise UnknownDetectorError(
            f"detector.backend: no detector {settings.detector.backend!r}: there are: {there_are}"
        )
    return build(settings)
