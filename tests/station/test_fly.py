"""`alight fly` before the flight: what it makes of the command line, and what it refuses."""

from collections.abc import Callable
from pathlib import Path

import pytest

from alight.runtime.bus import BusError
from schemas.settings import Settings
from station import fly
from station.__main__ import main
from station.director import FlightPlan
from station.live_flight import LiveOutcome
from station.lockstep_flight import LockstepOutcome

DRONE = "udpin://127.0.0.1:24541"
Fly = Callable[..., int]


class Asked:
    """What was asked of the flight; nothing is flown."""

    def __init__(self) -> None:
        self.plan: FlightPlan | None = None
        self.services: tuple[str, ...] = ()
        self.fails = False
        self.said_by_a_service = ""

    def live(
        self, _settings: Settings, plan: FlightPlan, services: tuple[str, ...], _file: Path, logs: Path
    ) -> LiveOutcome:
        self.plan, self.services = plan, services
        if self.said_by_a_service:
            (logs / "camera.jsonl").write_text(self.said_by_a_service)
        if self.fails:
            raise BusError("cannot join the bus")
        return LiveOutcome()

    def lockstep(self, _settings: Settings, plan: FlightPlan, _on_progress: object) -> LockstepOutcome:
        self.plan = plan
        return LockstepOutcome(failure=None, flown_s=1.0, took_s=1.0)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Asked:
    stand_in = Asked()
    monkeypatch.setattr(fly, "fly_live", stand_in.live)
    monkeypatch.setattr(fly, "fly_lockstep", stand_in.lockstep)
    monkeypatch.setattr(fly, "conclude", lambda _outcome, _out: 0)
    return stand_in


@pytest.fixture
def alight_fly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fly:
    monkeypatch.chdir(tmp_path)
    return lambda *words: main(["fly", "--out", str(tmp_path / "flight"), *words])


def one_line(capsys: pytest.CaptureFixture[str]) -> str:
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1, lines
    return lines[0]


def drone_toml(folder: Path) -> str:
    path = folder / "drone.toml"
    path.write_text(f'[commander]\nvehicle_url = "{DRONE}"\n', encoding="utf-8")
    return str(path)


def test_with_nothing_said_the_simulator_takes_off(asked: Asked, alight_fly: Fly) -> None:
    assert alight_fly() == 0
    assert asked.plan is not None and asked.plan.takeoff_to_ned_m is not None
    assert "simulator" in asked.services


def test_a_vehicle_that_only_a_file_names_is_not_flown(
    asked: Asked, alight_fly: Fly, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert alight_fly("--settings", drone_toml(tmp_path)) == 2
    assert asked.plan is None
    said = one_line(capsys)
    assert all(part in said for part in (DRONE, Settings().simulator.url, f"--vehicle {DRONE}"))


def test_a_vehicle_that_only_the_environment_names_is_not_flown(
    asked: Asked, alight_fly: Fly, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ALIGHT_COMMANDER__VEHICLE_URL", DRONE)
    assert alight_fly() == 2
    assert asked.plan is None
    assert f"--vehicle {DRONE}" in one_line(capsys)


@pytest.mark.parametrize(
    ("vehicle_url", "simulator_url"),
    [
        ("udpin://127.0.0.1:24541", "udp://127.0.0.1:24580?to=127.0.0.1:24541"),
        ("udpin://localhost:24541", "udp://127.0.0.1:24580?to=127.0.0.1:24541"),
        ("udpin://127.0.0.1:24541", "udpout://127.0.0.1:24541"),
    ],
)
def test_the_simulator_may_be_given_another_port(
    asked: Asked, alight_fly: Fly, vehicle_url: str, simulator_url: str
) -> None:
    assert alight_fly("--set", f"commander.vehicle_url={vehicle_url}", "--set", f"simulator.url={simulator_url}") == 0
    assert asked.plan is not None and asked.plan.takeoff_to_ned_m is not None


@pytest.mark.parametrize(
    "vehicle_url",
    [
        "udpin://0.0.0.0:14540",
        "udpin://127.0.0.2:14540",
        "udpin://:14540",
        "udpin://127.0.0.1:14541",
        "udpin://127.0.0.1:none",
        "udpin://drone.local:14540",
        "udpout://127.0.0.1:14540",
        "serial:///dev/ttyUSB0?baud=921600",
    ],
)
def test_a_link_on_which_others_may_be_heard_is_not_the_simulators(
    asked: Asked, alight_fly: Fly, vehicle_url: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert alight_fly("--set", f"commander.vehicle_url={vehicle_url}") == 2
    assert asked.plan is None
    assert vehicle_url in one_line(capsys)


@pytest.mark.parametrize("url", ["udp://127.0.0.1:14580", "udp://127.0.0.1:14580?to=192.0.2.7:14540", "nowhere"])
def test_a_simulator_that_sends_elsewhere_is_not_at_the_commanders_link(
    asked: Asked, alight_fly: Fly, url: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert alight_fly("--set", f"simulator.url={url}") == 2
    assert asked.plan is None
    assert url in one_line(capsys)


def test_a_px4_simulation_that_only_a_file_names_is_not_flown(
    asked: Asked, alight_fly: Fly, capsys: pytest.CaptureFixture[str]
) -> None:
    assert alight_fly("--set", "simulator.kind=mavlink_truth") == 2
    assert asked.plan is None
    assert "--vehicle udpin://127.0.0.1:14540 --truth udpin://127.0.0.1:14550" in one_line(capsys)


@pytest.mark.parametrize("elsewhere", ["simulator", "commander"])
def test_what_flies_elsewhere_takes_off_only_if_told_to(asked: Asked, alight_fly: Fly, elsewhere: str) -> None:
    assert alight_fly("--without", elsewhere) == 0
    assert asked.plan is not None and asked.plan.takeoff_to_ned_m is None
    assert alight_fly("--without", elsewhere, "--takeoff") == 0
    assert asked.plan.takeoff_to_ned_m is not None


def test_a_vehicle_that_is_named_is_flown_and_takes_off_only_if_told_to(
    asked: Asked, alight_fly: Fly, tmp_path: Path
) -> None:
    words = ("--vehicle", DRONE, "--settings", drone_toml(tmp_path), "--without", "camera")
    assert alight_fly(*words) == 0
    assert asked.plan is not None and asked.plan.takeoff_to_ned_m is None
    assert "simulator" not in asked.services
    assert alight_fly(*words, "--takeoff") == 0
    assert asked.plan.takeoff_to_ned_m is not None


@pytest.mark.parametrize(
    "words",
    [
        ("--without", "detector"),
        ("--without", "camera,recorder"),
        ("--set", "camera.source=device"),
        ("--set", "camera.source=stream"),
        ("--set", "camera.source=files"),
    ],
)
def test_in_lockstep_nothing_can_be_elsewhere(
    asked: Asked, alight_fly: Fly, words: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert alight_fly("--lockstep", *words) == 2
    assert asked.plan is None
    said = one_line(capsys)
    assert "--lockstep" in said and words[1] in said


def test_in_lockstep_no_link_is_used_so_that_a_drones_settings_may_be_tried(
    asked: Asked, alight_fly: Fly, tmp_path: Path
) -> None:
    assert alight_fly("--lockstep", "--settings", drone_toml(tmp_path)) == 0
    assert asked.plan is not None and asked.plan.takeoff_to_ned_m is not None


def test_with_a_vehicle_and_no_camera_the_usual_remedy_comes_first(
    asked: Asked, alight_fly: Fly, capsys: pytest.CaptureFixture[str]
) -> None:
    assert alight_fly("--vehicle", DRONE) == 2
    assert asked.plan is None
    said = one_line(capsys)
    usual, others = said.index("set camera.source=device or stream (docs/cameras.md)"), ("--truth", "--without camera")
    assert all(said.index(other) > usual for other in others)
    assert alight_fly("--vehicle", DRONE, "--set", "camera.source=device") == 0


@pytest.mark.parametrize("out", ["flight", "flights/of/today"])
def test_a_flight_of_which_nothing_came_leaves_no_folder_behind(
    asked: Asked, alight_fly: Fly, tmp_path: Path, out: str
) -> None:
    asked.fails = True
    assert alight_fly("--out", out) == 2
    assert list(tmp_path.iterdir()) == []


def test_in_lockstep_neither(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["fly", "--lockstep", "--set", "camera.calibration_file=none.toml"]) == 2
    assert list(tmp_path.iterdir()) == []


def test_what_somebody_may_want_to_read_stays(asked: Asked, alight_fly: Fly, tmp_path: Path) -> None:
    asked.fails = True
    asked.said_by_a_service = '{"event": "no such device"}'
    assert alight_fly() == 2
    assert (tmp_path / "flight" / "logs" / "camera.jsonl").read_text() == asked.said_by_a_service
    assert (tmp_path / "flight" / "settings.json").exists()


def test_a_folder_that_was_there_before_stays_with_all_that_it_holds(
    asked: Asked, alight_fly: Fly, tmp_path: Path
) -> None:
    logs = tmp_path / "flight" / "logs"
    logs.mkdir(parents=True)
    (logs / "mine.jsonl").touch()
    asked.fails = True
    assert alight_fly() == 2
    assert (logs / "mine.jsonl").exists()
