"""A detector that somebody else wrote, installed into a fresh environment, is found there and sees."""

import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import cv2
import pytest

from schemas import topics
from schemas.settings import Settings
from services.detector.conformance import drawn_pad
from station.flight_record import read_flight
from station.metrics.summary import summarise

REPOSITORY = Path(__file__).resolve().parents[2]

ENTRY_POINTS = """
[alight.detectors]
stranger = strangers_detector:build
unloadable = strangers_detector:nothing_of_that_name
"""

MODULE = """
from services.detector.registry import detector_from


class Stranger:
    name = "stranger"

    def __init__(self, inner):
        self._inner = inner

    def detect(self, view):
        return self._inner.detect(view)

    def counters(self):
        return {}


def build(settings):
    chosen = settings.detector.model_copy(update={"backend": "aruco"})
    return Stranger(detector_from(settings.model_copy(update={"detector": chosen})))
"""


def wheel(folder: Path) -> Path:
    """The package as it would be downloaded, made by hand: building one would need the network."""
    about = "strangers_detector-1.0.dist-info"
    files = {
        "strangers_detector.py": MODULE,
        f"{about}/METADATA": "Metadata-Version: 2.1\nName: strangers-detector\nVersion: 1.0\n",
        f"{about}/WHEEL": "Wheel-Version: 1.0\nGenerator: by hand\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{about}/entry_points.txt": ENTRY_POINTS,
    }
    files[f"{about}/RECORD"] = "".join(f"{name},,\n" for name in [*files, f"{about}/RECORD"])
    path = folder / "strangers_detector-1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return path


@pytest.fixture(scope="module")
def python(tmp_path_factory) -> Path:
    """The interpreter of a new environment that has the package, and else what this one has."""
    folder = tmp_path_factory.mktemp("stranger")
    environment = folder / "venv"
    venv.create(environment, symlinks=True)
    interpreter = environment / "bin" / "python"
    install = [
        sys.executable,
        "-m",
        "pip",
        "--python",
        str(interpreter),
        "install",
        "--quiet",
        "--no-deps",
        "--no-index",
    ]
    subprocess.run([*install, str(wheel(folder))], check=True, timeout=120)
    site = Path(sysconfig.get_path("purelib", "venv", {"base": str(environment), "platbase": str(environment)}))
    (site / "of_the_tests.pth").write_text(f"{sysconfig.get_path('purelib')}\n{REPOSITORY}\n")
    return interpreter


def run(python: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(python), *words], capture_output=True, text=True, timeout=120, check=False)


@pytest.mark.system
def test_it_is_found_and_sees_the_pad(python, tmp_path) -> None:
    cv2.imwrite(str(tmp_path / "pad.png"), drawn_pad(Settings()).picture)
    looked = run(python, "-m", "station", "detect", str(tmp_path / "pad.png"), "--detector", "stranger", "--id", "68")
    assert looked.returncode == 0, looked.stderr
    assert "68" in looked.stdout.splitlines()[1]


@pytest.mark.system
def test_it_flies_a_landing(python, tmp_path) -> None:
    out = tmp_path / "flight"
    chosen = (
        "--set",
        "detector.backend=stranger",
        "--set",
        "simulator.airborne={north_m=4.0, east_m=4.0, down_m=-12.0}",
    )
    flown = run(python, "-m", "station", "fly", "--lockstep", *chosen, "--out", str(out))
    assert flown.returncode == 0, flown.stdout + flown.stderr
    record = read_flight(out / "flight.mcap")
    assert summarise(record).verdict.ok
    assert {detection.detector for detection in record.messages(topics.DETECTION)} == {"stranger"}


@pytest.mark.system
def test_one_that_cannot_be_loaded_is_told_in_one_line(python, tmp_path) -> None:
    cv2.imwrite(str(tmp_path / "pad.png"), drawn_pad(Settings()).picture)
    looked = run(python, "-m", "station", "detect", str(tmp_path / "pad.png"), "--detector", "unloadable", "--id", "68")
    assert looked.returncode == 2
    assert "'unloadable' (strangers_detector:nothing_of_that_name) cannot be loaded" in looked.stderr
    assert looked.stderr.count("\n") == 1


@pytest.mark.system
def test_here_it_is_not_installed_and_the_names_that_are_there_are_told(tmp_path) -> None:
    cv2.imwrite(str(tmp_path / "pad.png"), drawn_pad(Settings()).picture)
    looked = run(
        Path(sys.executable),
        "-m",
        "station",
        "detect",
        str(tmp_path / "pad.png"),
        "--detector",
        "stranger",
        "--id",
        "68",
    )
    assert looked.returncode == 2
    assert "there are: aided, apriltag, aruco, charuco" in looked.stderr
