"""The quadrotor as a rigid body in the air and on the ground."""

import math

GRAVITY_MPS2 = 9.80665
MASS_KG = 1.0
INERTIA_XX_KGM2 = 0.025
INERTIA_YY_KGM2 = 0.025
INERTIA_ZZ_KGM2 = 0.030
ROTOR_THRUST_N = 5.0
"""Of one rotor at full command."""
ROTOR_TORQUE_NM = 0.1
"""Reaction of one rotor at full command."""
ROTOR_ARM_M = 0.2
"""Forward and sideways distance of each rotor from the centre."""
ROTOR_LAG_S = 0.05
"""Time constant of a rotor's thrust."""
ANGULAR_DRAG_NMS = 0.025
HOVER_COMMAND = MASS_KG * GRAVITY_MPS2 / (4.0 * ROTOR_THRUST_N)
GROUND_FRICTION_MPS2 = 6.0
STANDING_WIND_SHARE = 0.33
"""Wind at a standing vehicle against wind aloft: logarithmic profile over grass (3 cm roughness), 0.2 m against 10 m."""
LEVELLING_TIME_S = 0.05
"""How fast the legs right the vehicle when it stands."""

Motors = tuple[float, float, float, float]
Vector = tuple[float, float, float]


class Body:
    """State and motion of the vehicle, north, east and down from the ground at home.

    Rotors in PX4's order: 0 front right, 1 rear left (both turning counter-clockwise), 2 front left, 3 rear right (clockwise). Thrust is
    proportional to the lagged command. Plain floats throughout: one step has to cost a few microseconds.
    """

    def __init__(self, place_ned_m: Vector, yaw_rad: float, drag_n_per_mps: float, gear_height_m: float) -> None:
        self.north_m, self.east_m, self.down_m = place_ned_m
        self.vn, self.ve, self.vd = 0.0, 0.0, 0.0
        self.an, self.ae, self.ad = 0.0, 0.0, 0.0
        self.qw, self.qx, self.qy, self.qz = math.cos(0.5 * yaw_rad), 0.0, 0.0, math.sin(0.5 * yaw_rad)
        self.p, self.q, self.r = 0.0, 0.0, 0.0
        self.touching_ground = False
        self._u0, self._u1, self._u2, self._u3 = 0.0, 0.0, 0.0, 0.0
        self._drag_per_kg = drag_n_per_mps / MASS_KG
        self._gear_height_m = gear_height_m

    def hover(self) -> None:
        """Let the rotors carry the weight from now on, for a start in the air."""
        self._u0 = self._u1 = self._u2 = self._u3 = HOVER_COMMAND

    def step(self, motors: Motors, wind_ned_mps: Vector, ground_down_m: float, step_s: float) -> None:
        """Move on by `step_s` under commands of 0 to 1 (semi-implicit Euler)."""
        lag = step_s / ROTOR_LAG_S
        self._u0 += lag * (motors[0] - self._u0)
        self._u1 += lag * (motors[1] - self._u1)
        self._u2 += lag * (motors[2] - self._u2)
        self._u3 += lag * (motors[3] - self._u3)
        self._rotate(step_s)
        self._translate(wind_ned_mps, step_s)
        standing_down_m = ground_down_m - self._gear_height_m
        self.touching_ground = self.down_m >= standing_down_m
        if self.touching_ground:
            self._stand(standing_down_m, step_s)

    def _rotate(self, step_s: float) -> None:
        u0, u1, u2, u3 = self._u0, self._u1, self._u2, self._u3
        p, q, r = self.p, self.q, self.r
        arm = ROTOR_ARM_M * ROTOR_THRUST_N
        roll_nm = arm * (u1 + u2 - u0 - u3) - ANGULAR_DRAG_NMS * p
        pitch_nm = arm * (u0 + u2 - u1 - u3) - ANGULAR_DRAG_NMS * q
        yaw_nm = ROTOR_TORQUE_NM * (u0 + u1 - u2 - u3) - ANGULAR_DRAG_NMS * r
        p += step_s * (roll_nm - (INERTIA_ZZ_KGM2 - INERTIA_YY_KGM2) * q * r) / INERTIA_XX_KGM2
        q += step_s * (pitch_nm - (INERTIA_XX_KGM2 - INERTIA_ZZ_KGM2) * r * p) / INERTIA_YY_KGM2
        r += step_s * (yaw_nm - (INERTIA_YY_KGM2 - INERTIA_XX_KGM2) * p * q) / INERTIA_ZZ_KGM2
        self.p, self.q, self.r = p, q, r
        w, x, y, z = self.qw, self.qx, self.qy, self.qz
        half = 0.5 * step_s
        nw = w - half * (x * p + y * q + z * r)
        nx = x + half * (w * p + y * r - z * q)
        ny = y + half * (w * q + z * p - x * r)
        nz = z + half * (w * r + x * q - y * p)
        scale = 1.0 / math.sqrt(nw * nw + nx * nx + ny * ny + nz * nz)
        self.qw, self.qx, self.qy, self.qz = nw * scale, nx * scale, ny * scale, nz * scale

    def _translate(self, wind_ned_mps: Vector, step_s: float) -> None:
        w, x, y, z = self.qw, self.qx, self.qy, self.qz
        lift = ROTOR_THRUST_N / MASS_KG * (self._u0 + self._u1 + self._u2 + self._u3)
        drag = self._drag_per_kg
        if self.touching_ground:
            share = STANDING_WIND_SHARE
            wind_ned_mps = (share * wind_ned_mps[0], share * wind_ned_mps[1], share * wind_ned_mps[2])
        self.an = an = -2.0 * (x * z + w * y) * lift - drag * (self.vn - wind_ned_mps[0])
        self.ae = ae = -2.0 * (y * z - w * x) * lift - drag * (self.ve - wind_ned_mps[1])
        self.ad = ad = GRAVITY_MPS2 - (1.0 - 2.0 * (x * x + y * y)) * lift - drag * (self.vd - wind_ned_mps[2])
        self.vn += step_s * an
        self.ve += step_s * ae
        self.vd += step_s * ad
        self.north_m += step_s * self.vn
        self.east_m += step_s * self.ve
        self.down_m += step_s * self.vd

    def _stand(self, standing_down_m: float, step_s: float) -> None:
        self.down_m = standing_down_m
        self.vd = min(self.vd, 0.0)
        self.ad = min(self.ad, 0.0)
        speed = math.hypot(self.vn, self.ve)
        slowed = max(0.0, 1.0 - GROUND_FRICTION_MPS2 * step_s / speed) if speed > 0.0 else 0.0
        self.vn *= slowed
        self.ve *= slowed
        self.an = self.ae = 0.0
        self.p = self.q = self.r = 0.0
        # The yaw stays, roll and pitch go: the swing part of the quaternion fades out.
        fade = 1.0 - step_s / LEVELLING_TIME_S
        x, y = self.qx * fade, self.qy * fade
        scale = 1.0 / math.sqrt(self.qw * self.qw + x * x + y * y + self.qz * self.qz)
        self.qw, self.qx, self.qy, self.qz = self.qw * scale, x * scale, y * scale, self.qz * scale
