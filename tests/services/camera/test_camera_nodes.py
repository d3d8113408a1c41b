import cv2
import numpy as np
import pytest

from alight.runtime.node import Arrival
from schemas import topics
from schemas.settings import Settings
from services.camera.calibration_file import CalibrationError, read_calibration
from services.camera.service import build, build_live

HZ60_NS = 16_666_667
START_NS = 10_000_000_000


LEAD_NS = 30_000_000


def arrival(truth, late_ns=0):
    now_ns = truth.at_ns - LEAD_NS + late_ns
    return Arrival(topics.GROUND_TRUTH, truth, received_at_ns=now_ns, now_ns=now_ns)


def frames_of(node, truth_at, instants_ns):
    return [
        publication
        for at_ns in instants_ns
        for publication in node.on_message(arrival(truth_at(0.0, 0.0, -8.0, at_ns=at_ns)))
    ]


def test_every_second_truth_at_60_hz_makes_a_frame_at_30_hz(truth_at) -> None:
    frames = frames_of(build(Settings()), truth_at, [START_NS + HZ60_NS * index for index in range(12)])
    assert [frame.message.captured_at_ns for frame in frames] == [START_NS + 2 * HZ60_NS * index for index in range(6)]
    assert [frame.message.sequence for frame in frames] == list(range(6))


def test_after_a_gap_frames_do_not_come_in_a_burst(truth_at) -> None:
    instants = [START_NS, *(START_NS + 3_000_000_000 + HZ60_NS * index for index in range(4))]
    assert len(frames_of(build(Settings()), truth_at, instants)) == 3


def test_a_frame_leaves_when_its_light_has_hit_the_sensor_and_is_stamped_late_by_the_hidden_latency(truth_at) -> None:
    settings = Settings.model_validate(
        {"simulator": {"installation": {"image_latency_s": 0.05}}, "camera": {"simulated": {"delay_s": 0.01}}}
    )
    (frame,) = frames_of(build(settings), truth_at, [START_NS])
    assert frame.message.captured_at_ns == START_NS + 50_000_000
    assert frame.release_at_ns == START_NS + 60_000_000


def test_a_frame_that_cannot_be_begun_in_time_is_left_out_and_counted_and_the_next_one_comes(truth_at) -> None:
    node = build(Settings())
    late_ns = [0, 9_000_000, 11_000_000, 60_000_000, 0]
    came = [
        len(list(node.on_message(arrival(truth_at(0.0, 0.0, -8.0, at_ns=START_NS + 2 * HZ60_NS * index), late))))
        for index, late in enumerate(late_ns)
    ]
    assert came == [1, 1, 0, 0, 1]
    assert node.counters()["frames_skipped"] == 2


def test_the_truth_of_a_simulation_elsewhere_comes_without_lead_and_is_drawn_all_the_same(truth_at) -> None:
    node = build(Settings(simulator={"kind": "mavlink_truth"}))
    came = [
        len(list(node.on_message(arrival(truth_at(0.0, 0.0, -8.0, at_ns=START_NS + 2 * HZ60_NS * index), late))))
        for index, late in enumerate([40_000_000, 129_000_000, 131_000_000])
    ]
    assert came == [1, 1, 0]


def test_what_is_drawn_before_a_live_flight_changes_no_pixel(truth_at) -> None:
    seen = [
        [
            frame.pixels
            for frame in frames_of(
                built(Settings()), lambda n, e, _, at_ns: truth_at(n, e, -0.6, at_ns=at_ns), [START_NS]
            )
        ]
        for built in (build, build_live)
    ]
    np.testing.assert_array_equal(seen[0], seen[1])


def test_the_header_fits_the_pixels(truth_at) -> None:
    (frame,) = frames_of(build(Settings()), truth_at, [START_NS])
    assert frame.pixels.nbytes == frame.message.payload_bytes
    assert frame.message.exposure_s == pytest.approx(0.004)


def test_the_calibration_comes_once_a_second_and_is_the_papers_camera() -> None:
    node = build(Settings())
    assert node.tick_period_ns == 1_000_000_000
    (publication,) = node.on_tick(START_NS)
    assert publication.topic is topics.CALIBRATION
    assert publication.message.at_ns == START_NS
    assert publication.message.fx_px == pytest.approx(293.35)
    assert publication.message.distortion[4] == pytest.approx(0.01007)


def playing(tmp_path, **files):
    return build(
        Settings.model_validate(
            {"camera": {"source": "files", "rate_hz": 10.0, "files": {"paths": [str(tmp_path)], **files}}}
        )
    )


def frames_at_ticks(node, count):
    outputs = [publication for index in range(count) for publication in node.on_tick(START_NS + index * 100_000_000)]
    return [publication for publication in outputs if publication.topic is topics.FRAME]


def test_files_are_played_in_order_what_cannot_be_decoded_is_counted_and_the_end_is_told(tmp_path) -> None:
    cv2.imwrite(str(tmp_path / "a.png"), np.full((480, 640), 10, np.uint8))
    (tmp_path / "b.png").write_bytes(b"no picture")
    cv2.imwrite(str(tmp_path / "c.png"), np.full((480, 640, 3), 30, np.uint8))
    node = playing(tmp_path)
    frames = frames_at_ticks(node, 4)
    assert [(frame.message.source, frame.message.pixel_format.value) for frame in frames] == [
        ("a.png", "mono8"),
        ("c.png", "bgr8"),
    ]
    assert node.counters() == {"frames": 2, "undecodable": 1}
    assert node.complaints(START_NS) == ("no pictures left after 2; b.png cannot be decoded",)


def test_files_can_be_looped_and_mirrored(tmp_path) -> None:
    ramp = np.tile(np.arange(64, dtype=np.uint8), (48, 1))
    cv2.imwrite(str(tmp_path / "ramp.png"), ramp)
    frames = frames_at_ticks(playing(tmp_path, loop=True, mirrored=True), 3)
    assert len(frames) == 3
    assert np.array_equal(frames[2].pixels, ramp[:, ::-1])


def test_a_video_is_played_frame_by_frame(tmp_path) -> None:
    video = cv2.VideoWriter(str(tmp_path / "film.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (64, 48))
    for level in (20, 120, 220):
        video.write(np.full((48, 64, 3), level, np.uint8))
    video.release()
    frames = frames_at_ticks(playing(tmp_path), 5)
    assert [frame.message.source for frame in frames] == ["film.avi#0", "film.avi#1", "film.avi#2"]
    assert [round(float(frame.pixels.mean()), -1) for frame in frames] == [20, 120, 220]


def test_a_picture_of_another_size_than_the_calibration_is_complained_about(tmp_path) -> None:
    cv2.imwrite(str(tmp_path / "small.png"), np.zeros((48, 80), np.uint8))
    node = playing(tmp_path)
    frames_at_ticks(node, 1)
    assert "small.png is 80x48, the calibration is for 640x480, which has another shape" in node.complaints(START_NS)[0]


def test_the_calibration_is_scaled_to_pictures_of_another_size_and_the_same_shape(tmp_path) -> None:
    cv2.imwrite(str(tmp_path / "half.png"), np.zeros((240, 320), np.uint8))
    node = playing(tmp_path)
    calibration, frame = node.on_tick(START_NS)
    assert (calibration.message.width_px, calibration.message.height_px) == (320, 240)
    assert calibration.message.fx_px == pytest.approx(293.35 / 2)
    assert frame.message.width_px == 320
    assert "scaled, which is right if the camera bins" in node.complaints(START_NS)[0]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (None, r"lens.toml: cannot be read \(No such file or directory\): correct camera.calibration_file"),
        ("fx_px = 1.0", "width_px is missing: give width_px"),
        ("fx_px = ", "not valid TOML"),
        ("width_px=640\nheight_px=480\nfx_px=-3.0\nfy_px=3.0\ncx_px=1.0\ncy_px=1.0", "fx_px: .*greater than 0"),
        ("width_px=640\nheight_px=480\nfx_px=3.0\nfy_px=3.0\ncx_px=1.0\ncy_px=1.0\nk1=3", "k1: "),
    ],
)
def test_a_wrong_calibration_file_stops_the_service_with_one_line(tmp_path, text, says) -> None:
    path = tmp_path / "lens.toml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(CalibrationError, match=says) as caught:
        build(Settings.model_validate({"camera": {"calibration_file": str(path)}}))
    assert "\n" not in str(caught.value)


def test_opencvs_yaml_is_read_too(tmp_path) -> None:
    path = tmp_path / "lens.yml"
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("camera_matrix", np.array([[500.0, 0, 320], [0, 501, 240], [0, 0, 1]]))
    storage.write("distortion_coefficients", np.array([[0.1, -0.2, 0.0, 0.01, 0.3]]))
    storage.release()
    calibration = read_calibration(path, "--camera", (640, 480))
    assert (calibration.fx_px, calibration.fy_px, calibration.cx_px) == (500.0, 501.0, 320.0)
    assert calibration.distortion == (0.1, -0.2, 0.0, 0.01, 0.3)


def test_no_files_is_an_error_of_the_settings(tmp_path) -> None:
    with pytest.raises(ValueError, match=r"camera.files.paths is empty"):
        build(Settings.model_validate({"camera": {"source": "files"}}))
    with pytest.raises(ValueError, match="no such image, video, directory or match"):
        playing(tmp_path / "missing")
