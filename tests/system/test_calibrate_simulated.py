"""The paper's calibration flight, from the command line to a file that a flight takes."""

import subprocess
import sys
from pathlib import Path

import pytest

from alight.runtime.settings_file import load_settings
from services.camera.calibration_file import configured_calibration

pytestmark = pytest.mark.system


def test_the_spiral_flight_recovers_the_camera_of_the_paper(tmp_path: Path) -> None:
    out = tmp_path / "calibration"
    command = [sys.executable, "-m", "station", "calibrate", "camera", "--simulated", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr

    settings = load_settings(None, {}, [f"camera.calibration_file={out / 'calibration.toml'}"])
    found, true = configured_calibration(settings.camera), configured_calibration(load_settings(None, {}, []).camera)
    assert abs(found.fx_px / true.fx_px - 1.0) < 2e-3
    assert abs(found.fy_px / true.fy_px - 1.0) < 2e-3
    assert abs(found.cx_px - true.cx_px) < 0.3
    assert abs(found.cy_px - true.cy_px) < 0.3
    off = [
        line.split()[-1]
        for line in done.stdout.splitlines()
        if line[:2] in {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"}
    ]
    assert max(abs(float(sigmas)) for sigmas in off[:9]) < 3.0
    assert (out / "report.html").stat().st_size > 5_000
