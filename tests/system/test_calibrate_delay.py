"""`alight calibrate delay` on a flown hover: the injected delay is found, and the line that it offers is a setting."""

import re
import tomllib
from pathlib import Path

import pytest

from schemas.settings import Settings
from station.__main__ import main
from station.experiment.hover_flights import fly_hovers
from station.experiment.hover_plan import HoverPlace

pytestmark = pytest.mark.system

INJECTED_S = 0.06


def test_the_delay_of_a_flown_hover_is_found_and_offered_as_a_setting(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    gusty = ["simulator.wind.gust_mps=2", f"simulator.installation.image_latency_s={INJECTED_S}"]
    (flight,) = fly_hovers([HoverPlace(0.0, 0.0)], 600, 900, tmp_path, {}, gusty)
    assert main(["calibrate", "delay", str(flight)]) == 0
    said = capsys.readouterr().out
    pasted = re.search(r"\[geolocator\.lookup\]\nimage_latency_s = \S+", said)
    assert pasted, said
    settings = Settings.model_validate(tomllib.loads(pasted[0]))
    assert settings.geolocator.lookup.image_latency_s == pytest.approx(INJECTED_S, abs=0.005)


def test_a_flight_that_is_none_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "delay", str(tmp_path)]) == 1
    assert capsys.readouterr().err.startswith("alight calibrate delay: ")
