"""Every detector there is, our own and those of installed packages, under the one suite."""

import pytest

from schemas.settings import Settings
from services.detector.conformance import CHECKS, ConformanceError
from services.detector.registry import detector_from, detector_names
from tests.services.detector.own_model import contrast_model

PADS = {"apriltag": {"family": "apriltag_36h11", "id": 5}, "charuco": {"layout": "charuco"}}
"""For those that do not read the paper's pad."""
NEEDS = {"apriltag": "pyapriltags", "yolo": "onnxruntime"}
"""Extras, which this environment may be without."""


@pytest.fixture(scope="session")
def models(tmp_path_factory) -> dict[str, dict[str, str]]:
    """For those that need one: it sees something in whatever is not as grey as the ground."""
    return {"yolo": {"model": contrast_model(tmp_path_factory.mktemp("models") / "contrast.onnx", box_px=60.0)}}


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__.removeprefix("check_"))
@pytest.mark.parametrize("name", detector_names())
def test_the_detector_conforms(name, check, models) -> None:
    if name in NEEDS:
        pytest.importorskip(NEEDS[name], reason=f"the extra `{name}` is not installed")
    settings = {"detector": {"backend": name, **models}, "pad": PADS.get(name, {})}
    check(detector_from, Settings.model_validate(settings))


@pytest.mark.parametrize("family", ["apriltag_16h5", "apriltag_25h9"])
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__.removeprefix("check_"))
def test_apriltag_conforms_with_its_other_families(family, check) -> None:
    check(
        detector_from,
        Settings.model_validate(
            {
                "detector": {"backend": "apriltag"},
                "pad": {"family": family, "id": 7},
            }
        ),
    )


class _HalfAPixelOff:
    name = "half_a_pixel_off"

    def __init__(self, settings: Settings) -> None:
        chosen = settings.detector.model_copy(update={"backend": "aruco"})
        self._inner = detector_from(settings.model_copy(update={"detector": chosen}))

    def detect(self, view):
        return tuple(
            type(marker)(marker.family, marker.id, marker.corners_px + 0.5, marker.corner_sigma_px)
            for marker in self._inner.detect(view)
        )

    def counters(self):
        return {}


def test_half_a_pixel_is_noticed() -> None:
    (check,) = [each for each in CHECKS if "centre_is_the_origin" in each.__name__]
    with pytest.raises(ConformanceError, match=r"shifted by \+0\.[45]"):
        check(_HalfAPixelOff)
