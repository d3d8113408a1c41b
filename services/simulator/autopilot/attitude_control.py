"""Attitude P, rate PID and the mixer."""

import math

from services.simulator.autopilot.parameters import Parameters
from services.simulator.body import Motors
from services.simulator.estimator import Estimate

MIX = 0.7071
"""Share of a roll or pitch command that each rotor of an X takes."""
D_FILTER_S = 1.0 / (2.0 * math.pi * 30.0)
INTEGRAL_BOUND = 0.3


def attitude_for(thrust: tuple[float, float, float], yaw_rad: float) -> tuple[tuple[float, float, float, float], float]:
    """The attitude whose up axis is the thrust vector and whose nose points to an azimuth, and the thrust's length.

    The shortest rotation from level to the thrust's direction, after a turn about the vertical.

    Args:
        thrust: North, east, down.
        yaw_rad: Azimuth of the nose.

    Returns:
        Quaternion w, x, y, z taking body to NED coordinates, and the collective thrust.
    """
    tn, te, td = thrust
    length = math.sqrt(tn * tn + te * te + td * td)
    if length < 1e-6:
        return (math.cos(0.5 * yaw_rad), 0.0, 0.0, math.sin(0.5 * yaw_rad)), 0.0
    # Body z in NED is -thrust. Heading frame first, then tilt about a horizontal axis.
    zn, ze, zd = -tn / length, -te / length, -td / length
    cos_yaw, sin_yaw = math.cos(yaw_rad), math.sin(yaw_rad)
    zx, zy = cos_yaw * zn + sin_yaw * ze, cos_yaw * ze - sin_yaw * zn
    # The nose keeps its azimuth: roll and pitch from z in the heading frame.
    pitch = math.atan2(zx, zd)
    roll = math.asin(max(-1.0, min(1.0, -zy)))
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    cp, sp = math.cos(0.5 * pitch), math.sin(0.5 * pitch)
    cy, sy = math.cos(0.5 * yaw_rad), math.sin(0.5 * yaw_rad)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ), length


class AttitudeControl:
    """The inner loops, run at every step."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._version = -1
        self._ip = self._iq = self._ir = 0.0
        self._last_p = self._last_q = 0.0
        self._dp = self._dq = 0.0

    def reset(self) -> None:
        """Forget the integrals."""
        self._ip = self._iq = self._ir = 0.0

    def step(
        self,
        wanted: tuple[float, float, float, float],
        thrust: float,
        yaw_rate: float,
        estimate: Estimate,
        step_s: float,
    ) -> Motors:
        """Rotor commands that turn the vehicle to the attitude `wanted` (w, x, y, z) under a collective thrust of 0 to 1."""
        if self._version != self._parameters.version:
            self._load()
        rate_p, rate_q, rate_r = self._rates(wanted, yaw_rate, estimate)
        p, q, r = estimate.p, estimate.q, estimate.r
        keep = D_FILTER_S / (D_FILTER_S + step_s)
        self._dp = keep * self._dp + (1.0 - keep) * (p - self._last_p) / step_s
        self._dq = keep * self._dq + (1.0 - keep) * (q - self._last_q) / step_s
        self._last_p, self._last_q = p, q
        error_p, error_q, error_r = rate_p - p, rate_q - q, rate_r - r
        roll = self._p_roll * error_p + self._ip - self._d_roll * self._dp
        pitch = self._p_pitch * error_q + self._iq - self._d_pitch * self._dq
        yaw = self._p_yaw * error_r + self._ir
        bound = INTEGRAL_BOUND
        self._ip = max(-bound, min(bound, self._ip + self._i_roll * error_p * step_s))
        self._iq = max(-bound, min(bound, self._iq + self._i_pitch * error_q * step_s))
        self._ir = max(-bound, min(bound, self._ir + self._i_yaw * error_r * step_s))
        return mix(thrust, MIX * roll, MIX * pitch, yaw)

    def _rates(
        self, wanted: tuple[float, float, float, float], yaw_rate: float, estimate: Estimate
    ) -> tuple[float, float, float]:
        """Rates that close the attitude error: the swing (tilt) with the full gain, the twist about body z with the yaw gain."""
        a, b, c, d = estimate.qw, estimate.qx, estimate.qy, estimate.qz
        e, f, g, h = wanted
        w = a * e + b * f + c * g + d * h
        x = a * f - b * e - c * h + d * g
        y = a * g + b * h - c * e - d * f
        z = a * h - b * g + c * f - d * e
        if w < 0.0:
            w, x, y, z = -w, -x, -y, -z
        n = math.sqrt(w * w + z * z)
        if n < 1e-6:
            return math.copysign(self._rate_max, x), 0.0, 0.0
        bound = self._rate_max
        p = 2.0 * self._p_roll_angle * (x * w - y * z) / n
        q = 2.0 * self._p_pitch_angle * (y * w + x * z) / n
        r = 2.0 * self._p_yaw_angle * math.atan2(z, w) + yaw_rate
        return (
            max(-bound, min(bound, p)),
            max(-bound, min(bound, q)),
            max(-self._yaw_rate_max, min(self._yaw_rate_max, r)),
        )

    def _load(self) -> None:
        value = self._parameters.__getitem__
        self._version = self._parameters.version
        self._p_roll_angle, self._p_pitch_angle, self._p_yaw_angle = (
            value("MC_ROLL_P"),
            value("MC_PITCH_P"),
            value("MC_YAW_P"),
        )
        self._p_roll, self._i_roll, self._d_roll = (
            value("MC_ROLLRATE_P"),
            value("MC_ROLLRATE_I"),
            value("MC_ROLLRATE_D"),
        )
        self._p_pitch, self._i_pitch, self._d_pitch = (
            value("MC_PITCHRATE_P"),
            value("MC_PITCHRATE_I"),
            value("MC_PITCHRATE_D"),
        )
        self._p_yaw, self._i_yaw = value("MC_YAWRATE_P"), value("MC_YAWRATE_I")
        self._rate_max, self._yaw_rate_max = (
            math.radians(value("MC_ROLLRATE_MAX")),
            math.radians(value("MC_YAWRATE_MAX")),
        )


def mix(thrust: float, roll: float, pitch: float, yaw: float) -> Motors:
    """Commands of 0 to 1 for the four rotors; where they do not fit, yaw gives way first, then thrust, roll and pitch last."""
    m0, m1, m2, m3 = pitch - roll, roll - pitch, roll + pitch, -roll - pitch
    reach = abs(roll) + abs(pitch)
    if reach > 0.5:
        scale = 0.5 / reach
        m0, m1, m2, m3, reach = m0 * scale, m1 * scale, m2 * scale, m3 * scale, 0.5
    thrust = min(max(thrust, reach if thrust > 0.0 else 0.0), 1.0 - reach)
    room = max(0.0, min(thrust, 1.0 - thrust) - reach)
    yaw = max(-room, min(room, yaw))
    return (
        max(0.0, thrust + m0 + yaw),
        max(0.0, thrust + m1 + yaw),
        max(0.0, thrust + m2 - yaw),
        max(0.0, thrust + m3 - yaw),
    )
