"""An independent MAVLink client, MAVSDK, flies the embedded autopilot as it would fly PX4."""

import contextlib
import math
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest
from flight_process import free_port

pytestmark = pytest.mark.system

mavsdk = pytest.importorskip("mavsdk", minversion="4.0")


@contextlib.contextmanager
def simulator(listen: int, send: int) -> Iterator[None]:
    """`python -m services.simulator` on ports of its own."""
    bus = free_port()
    command = [
        sys.executable, "-m", "services.simulator",
        "--set", f"simulator.url=udp://127.0.0.1:{listen}?to=127.0.0.1:{send}",
        "--set", f'bus.connect=["tcp/127.0.0.1:{bus}"]',
    ]  # fmt: skip
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as process:
        try:
            yield
        finally:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                raise


def wait_for(what: str, condition: Callable[[], object], timeout_s: float) -> None:
    """Poll until something is so."""
    deadline_s = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline_s, f"{what}: not within {timeout_s} s"
        time.sleep(0.1)


@pytest.fixture
def vehicle() -> Iterator[object]:
    """MAVSDK's view of a simulator that has just been switched on."""
    listen, send = free_port(socket.SOCK_DGRAM), free_port(socket.SOCK_DGRAM)
    with simulator(listen, send):
        configuration = mavsdk.Configuration.create_with_component_type(mavsdk.ComponentType.GROUND_STATION)
        with mavsdk.Mavsdk(configuration) as sdk:
            sdk.add_any_connection(f"udpin://127.0.0.1:{send}")
            system = sdk.first_autopilot(timeout_s=20.0)
            assert system is not None, "MAVSDK has not discovered the autopilot"
            yield system


def test_mavsdk_connects_arms_takes_off_goes_to_a_place_and_lands(vehicle):
    from mavsdk.plugins.action import Action  # noqa: PLC0415  (loads the native library)
    from mavsdk.plugins.telemetry import Telemetry  # noqa: PLC0415

    action, telemetry = Action(vehicle), Telemetry(vehicle)
    wait_for("ready to arm", telemetry.health_all_ok, 30)
    home = telemetry.position()
    action.set_takeoff_altitude(8.0)
    action.arm()
    wait_for("armed", telemetry.armed, 5)
    action.takeoff()
    wait_for("at 8 m", lambda: telemetry.position().relative_altitude_m > 7.3, 40)

    north_deg = 6.0 / 111_170.0
    action.goto_location(home.latitude_deg + north_deg, home.longitude_deg, home.absolute_altitude_m + 8.0, math.nan)

    def away_m() -> float:
        here = telemetry.position()
        east_m = (here.longitude_deg - home.longitude_deg) * 111_412.0 * math.cos(math.radians(home.latitude_deg))
        return math.hypot((here.latitude_deg - home.latitude_deg - north_deg) * 111_170.0, east_m)

    wait_for("at the place", lambda: away_m() < 0.6, 40)
    action.land()
    wait_for("disarmed", lambda: not telemetry.armed(), 60)
    assert away_m() < 1.0
    assert abs(telemetry.position().absolute_altitude_m - home.absolute_altitude_m) < 0.5


def test_mavsdk_is_refused_as_px4_would_refuse_it(vehicle):
    from mavsdk.plugins.action import Action, ActionError  # noqa: PLC0415
    from mavsdk.plugins.telemetry import Telemetry  # noqa: PLC0415

    action, telemetry = Action(vehicle), Telemetry(vehicle)
    wait_for("ready to arm", telemetry.health_all_ok, 30)
    action.land()
    with pytest.raises(ActionError):
        action.arm()
    action.hold()
    action.arm()
    wait_for("armed", telemetry.armed, 5)
    wait_for("disarmed when idle", lambda: not telemetry.armed(), 15)
