"""Vehicle, world and autopilot together: one step of everything that is simulated."""

import math

from alight.runtime.seed import generator
from schemas.settings import Settings
from schemas.truth import GroundTruth
from services.simulator.autopilot.autopilot import OFF, Autopilot
from services.simulator.autopilot.parameters import Parameters
from services.simulator.body import MASS_KG, Body
from services.simulator.estimator import Estimate
from services.simulator.noise import Normals
from services.simulator.wind import WindField
from services.simulator.world import World

STEP_S = 0.004
STEP_NS = 4_000_000
AIRBORNE_BOOT_S = 10.0
"""A start in the air begins with this uptime: everything is ready."""


class Vehicle:
    """The simulated vehicle. Motion comes from the truth, control from the estimate."""

    def __init__(self, settings: Settings) -> None:
        simulator = settings.simulator
        self.world = World.from_settings(simulator)
        gear_m = simulator.vehicle.gear_height_m
        self.origin_down_m = -gear_m
        """Down coordinate of the local frame's origin: the body's place when it stands at home."""
        azimuth_rad = math.radians(simulator.home.azimuth_deg)
        self.body = Body((0.0, 0.0, -gear_m), azimuth_rad, simulator.vehicle.drag_n_per_mps, gear_m)
        normals = Normals(generator(settings.seed, "simulator.wind"))
        self.wind = WindField(simulator.wind, normals, STEP_S)
        errors = generator(settings.seed, "simulator.sensors")
        self.estimate = Estimate(simulator.sensors, errors, STEP_S, self.origin_down_m)
        self.autopilot = Autopilot(Parameters(simulator.parameters), self.world.altitude_amsl_m - self.origin_down_m)
        self._drag_per_kg = simulator.vehicle.drag_n_per_mps / MASS_KG
        self._motors = OFF
        self._sense()
        if simulator.airborne is not None:
            place = simulator.airborne
            pad_n, pad_e, pad_d = self.world.pad_ned_m
            self._lift_to(pad_n + place.north_m, pad_e + place.east_m, pad_d + place.down_m)

    def step(self) -> None:
        """Move on by `STEP_S`."""
        body = self.body
        self.wind.advance()
        ground_down_m = self.world.ground_down_m(body.north_m, body.east_m)
        body.step(self._motors, self.wind.velocity_ned_mps, ground_down_m, STEP_S)
        self.estimate.update(body, ground_down_m - self._standing_m)
        self._motors = self.autopilot.step(self.estimate, STEP_S)

    def ground_truth(self, at_ns: int) -> GroundTruth:
        """What really is, at the step's time."""
        body, world = self.body, self.world
        pad_n, pad_e, pad_d = world.pad_ned_m
        return GroundTruth(
            at_ns=at_ns,
            vehicle_position=world.global_position(body.north_m, body.east_m, body.down_m),
            velocity_ned_mps=(body.vn, body.ve, body.vd),
            q_ned_body=(body.qw, body.qx, body.qy, body.qz),
            angular_velocity_body_rps=(body.p, body.q, body.r),
            pad_position=world.global_position(pad_n, pad_e, pad_d),
            pad_azimuth_rad=world.pad_azimuth_rad,
            vehicle_from_pad_ned_m=(body.north_m - pad_n, body.east_m - pad_e, body.down_m - pad_d),
            touching_ground=body.touching_ground,
        )

    @property
    def _standing_m(self) -> float:
        """The distance sensor reads zero when the vehicle stands."""
        return -self.origin_down_m

    def _sense(self) -> None:
        body = self.body
        self.estimate.update(body, self.world.ground_down_m(body.north_m, body.east_m) - self._standing_m)

    def _lift_to(self, north_m: float, east_m: float, down_m: float) -> None:
        body, autopilot = self.body, self.autopilot
        home = (self.estimate.north, self.estimate.east, self.estimate.down)
        body.north_m, body.east_m, body.down_m = north_m, east_m, down_m
        body.vn = body.ve = body.vd = 0.0
        body.hover()
        self._sense()
        autopilot.now_s = AIRBORNE_BOOT_S
        wind_n, wind_e, _ = self.wind.velocity_ned_mps
        autopilot.start_airborne(self.estimate, (-self._drag_per_kg * wind_n, -self._drag_per_kg * wind_e))
        autopilot.set_home(home, self.estimate.yaw)
