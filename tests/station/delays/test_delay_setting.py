"""The delay is undone where the stamps are made, if that is ours."""

import pytest

from schemas.settings import Settings
from station.calibrate.delay_command import besides, setting_for


def test_a_simulated_or_played_cameras_pose_is_looked_up_earlier():
    settings = Settings.model_validate({"geolocator": {"lookup": {"image_latency_s": 0.02}}})
    assert setting_for(settings, 0.06) == ("geolocator.lookup", "image_latency_s", 0.06)


@pytest.mark.parametrize("source", ["device", "stream"])
def test_a_live_cameras_stamps_are_put_right_on_top_of_what_was_subtracted_already(source):
    live = {"delay_s": 0.012, "url": "rtsp://192.0.2.1/"}
    settings = Settings.model_validate({"camera": {"source": source, "live": live}})
    section, key, value = setting_for(settings, 0.06)
    assert (section, key) == ("camera.live", "delay_s")
    assert value == pytest.approx(0.072)


def test_a_live_cameras_pose_is_then_not_looked_up_earlier_as_well():
    lookup = {"lookup": {"image_latency_s": 0.02}}
    live = Settings.model_validate({"camera": {"source": "device"}, "geolocator": lookup})
    assert "take out geolocator.lookup.image_latency_s = 0.02" in besides(live)
    assert besides(Settings.model_validate({"geolocator": lookup})) == ""
    assert besides(Settings.model_validate({"camera": {"source": "device"}})) == ""
