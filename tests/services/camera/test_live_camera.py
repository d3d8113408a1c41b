"""A camera that is there: its stamps, its lie, its silence."""

import contextlib

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from alight.runtime.node import Publication
from alight.runtime.port import PortError
from schemas import topics
from schemas.settings import Settings
from services.camera.capture_stamp import ReadMoment, stamped
from services.camera.live_node import PORT
from services.camera.live_packet import LivePicture, Trouble, packed, unpacked
from services.camera.service import build, open_ports

NOW_NS = 1_767_225_600_000_000_000
SIZE = {"camera": {"calibration": {"width_px": 4, "height_px": 3}}}


def live_settings(**live) -> Settings:
    return Settings.model_validate({"camera": {"source": "device", "live": live, **SIZE["camera"]}})


def pixels_of(height: int = 3, width: int = 4) -> np.ndarray:
    return np.arange(height * width, dtype=np.uint8).reshape(height, width)


def given_to(node, picture: LivePicture | Trouble, now_ns: int = NOW_NS) -> list[Publication]:
    return list(node.on_bytes(PORT, packed(picture), now_ns))


@given(
    st.one_of(
        arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9))),
        arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9), st.just(3))),
    ),
    st.integers(0, 2**62),
    st.booleans(),
)
def test_a_picture_survives_its_packing(pixels, stamped_at_ns, by_driver) -> None:
    back = unpacked(packed(LivePicture(stamped_at_ns, by_driver, pixels)))
    assert (back.stamped_at_ns, back.by_driver) == (stamped_at_ns, by_driver)
    np.testing.assert_array_equal(back.pixels, pixels)


@given(st.binary(max_size=60))
def test_bytes_that_are_no_packet_are_refused_and_never_anything_else(data) -> None:
    with contextlib.suppress(ValueError):
        assert isinstance(unpacked(data), LivePicture | Trouble)


@given(st.integers(0, 900_000_000))
def test_a_credible_stamp_of_the_driver_counts(age_ns) -> None:
    read = ReadMoment(utc_ns=NOW_NS, monotonic_ns=50_000_000_000)
    at_ns, by_driver = stamped((read.monotonic_ns - age_ns) / 1e6, read)
    assert by_driver
    assert at_ns == pytest.approx(NOW_NS - age_ns, abs=1000)


@pytest.mark.parametrize("driver_ms", [0.0, -5.0, 33.3, 60_000.0, float("nan"), float("inf")])
def test_a_stamp_of_another_clock_does_not(driver_ms) -> None:
    read = ReadMoment(utc_ns=NOW_NS, monotonic_ns=50_000_000_000)
    assert stamped(driver_ms, read) == (NOW_NS, False)


def test_the_measured_delay_is_subtracted_from_the_stamp() -> None:
    node = build(live_settings(delay_s=0.03))
    (frame,) = given_to(node, LivePicture(NOW_NS, True, pixels_of()))
    assert frame.topic is topics.FRAME
    assert frame.message.captured_at_ns == NOW_NS - 30_000_000
    assert frame.message.source == "/dev/video0"


def test_a_frame_that_is_no_later_than_the_one_before_is_left_out_and_counted() -> None:
    node = build(live_settings())
    assert given_to(node, LivePicture(NOW_NS, True, pixels_of()))
    assert not given_to(node, LivePicture(NOW_NS, True, pixels_of()))
    assert node.counters()["not_later"] == 1


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("rotated_deg", [0, 90, 180, 270])
def test_turned_and_mirrored_mounts_give_the_picture_that_the_calibrated_camera_saw(rotated_deg, mirrored) -> None:
    upright = pixels_of()
    hung = np.rot90(upright, rotated_deg // 90)  # numpy turns counter-clockwise, the setting turns back clockwise
    hung = cv2.flip(np.ascontiguousarray(hung), 1) if mirrored else hung
    node = build(live_settings(rotated_deg=rotated_deg, mirrored=mirrored))
    (frame,) = given_to(node, LivePicture(NOW_NS, True, hung))
    np.testing.assert_array_equal(frame.pixels, upright)
    assert node.complaints(NOW_NS) == ()


def test_it_complains_of_a_camera_that_is_gone_silent_or_of_another_size_and_no_longer_when_it_is_mended() -> None:
    node = build(live_settings(silent_s=1.0))
    given_to(node, Trouble("/dev/video0 cannot be opened"))
    assert node.complaints(NOW_NS) == ("/dev/video0 cannot be opened",)
    given_to(node, LivePicture(NOW_NS, True, pixels_of()))
    assert node.complaints(NOW_NS) == ()
    assert "silent for 2.0 s" in node.complaints(NOW_NS + 2_000_000_000)[0]
    given_to(node, LivePicture(NOW_NS + 1, True, pixels_of(6, 8)))
    assert "gives 8x6, the calibration is for 4x3" in node.complaints(NOW_NS)[0]


@pytest.mark.parametrize(
    ("live", "named"),
    [
        ({"url": ""}, "camera.live.url"),
        ({"url": "cam1.local"}, "rtsp://"),
        ({"url": "videotestsrc ! appsink", "via": "gstreamer"}, "camera.live.via"),
    ],
)
def test_a_stream_that_cannot_work_is_refused_at_once(live, named) -> None:
    if live.get("via") == "gstreamer" and cv2.videoio_registry.hasBackend(cv2.CAP_GSTREAMER):
        pytest.skip("this OpenCV has GStreamer")
    settings = Settings.model_validate({"camera": {"source": "stream", "live": live}})
    with pytest.raises(PortError, match=named):
        open_ports(settings)
