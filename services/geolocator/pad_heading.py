"""A pad whose azimuth is surveyed tells the heading better than a compass: how the print is turned in the picture is the compass's error."""

import math

from alight.geometry.local import moved_by_ned
from alight.geometry.rotation import wrap_pi
from alight.runtime.clock import seconds
from schemas.fix import PadFix, PadPosition, SharedErrors
from schemas.message import Matrix3, Vector3
from schemas.settings.geolocator import SurveyedHeading

_GATE = 4.0
"""In sigmas. A pad that seems to be turned by more is not where it was surveyed, or it is another."""
_COMPLAIN_AFTER = 10


class PadHeading:
    """Follows the heading's error, and takes it out of fixes.

    The error is a first-order Gauss-Markov process of the compass's size (`uncertainty.yaw_deg`); each fix's azimuth minus the
    surveyed one is a measurement of it.
    """

    def __init__(self, survey: SurveyedHeading, yaw_deg: float) -> None:
        self._surveyed_rad = None if survey.pad_azimuth_deg is None else math.radians(survey.pad_azimuth_deg)
        self._survey2 = math.radians(survey.sigma_deg) ** 2
        self._time_s = survey.time_s
        self._prior2 = math.radians(yaw_deg) ** 2
        self._error_rad = 0.0
        self._variance = self._prior2
        self._at_ns: int | None = None
        self._contradictions = 0
        self._off_rad = 0.0
        self.refused = 0
        """Fixes whose azimuth contradicts the survey."""

    def complaints(self) -> tuple[str, ...]:
        """Says so if the pad keeps being turned otherwise than surveyed."""
        if self._contradictions < _COMPLAIN_AFTER:
            return ()
        return (
            f"the pad is turned by {math.degrees(self._off_rad):+.1f} deg against geolocator.heading.pad_azimuth_deg: "
            "survey it anew, or leave the key out",
        )

    def aided(self, fix: PadFix) -> PadFix:
        """The fix with the heading that the pad tells; as it is where none was surveyed, nothing was fixed, or the survey contradicts it."""
        if self._surveyed_rad is None or self._prior2 == 0.0 or fix.corrected is None or fix.shared is None:
            return fix
        assert fix.azimuth_noise_rad2 is not None and fix.covariance_ned_m2 is not None, "an accepted fix has them"
        seen_rad = wrap_pi(fix.corrected.azimuth_rad - self._surveyed_rad)
        if not self._measured(seen_rad, fix.azimuth_noise_rad2, fix.captured_at_ns):
            return fix
        part = math.sqrt((self._variance + self._survey2) / self._prior2)
        shared = _scaled(fix.shared, part)
        return fix.model_copy(
            update={
                "corrected": _turned(fix, fix.corrected, -self._error_rad),
                "shared": shared,
                "covariance_ned_m2": _exchanged(fix.covariance_ned_m2, fix.shared.heading_ned_m, shared.heading_ned_m),
                "azimuth_variance_rad2": fix.azimuth_noise_rad2 + shared.heading_rad**2,
            }
        )

    def _measured(self, seen_rad: float, noise_rad2: float, at_ns: int) -> bool:
        """Take a measurement of the error in; False if it is too far off to be one."""
        if self._at_ns is not None:
            keep = math.exp(-max(0.0, seconds(at_ns - self._at_ns)) / self._time_s)
            self._error_rad *= keep
            self._variance = keep**2 * self._variance + (1.0 - keep**2) * self._prior2
        self._at_ns = at_ns
        innovation_rad = wrap_pi(seen_rad - self._error_rad)
        expected2 = self._variance + noise_rad2
        if innovation_rad**2 > _GATE**2 * (expected2 + self._survey2):
            self.refused += 1
            self._contradictions += 1
            self._off_rad = seen_rad
            return False
        self._contradictions = 0
        gain = self._variance / expected2
        self._error_rad += gain * innovation_rad
        self._variance *= 1.0 - gain
        return True


def _turned(fix: PadFix, pad: PadPosition, turn_rad: float) -> PadPosition:
    """The pad's place and azimuth turned about the vehicle, clockwise seen from above."""
    north, east, down = pad.pad_ned_m
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    pad_ned_m: Vector3 = (c * north - s * east, s * north + c * east, down)
    assert fix.vehicle_position is not None, "an accepted fix has it"
    return PadPosition(
        pad_ned_m=pad_ned_m,
        position=moved_by_ned(fix.vehicle_position, pad_ned_m),
        azimuth_rad=wrap_pi(pad.azimuth_rad + turn_rad),
    )


def _scaled(shared: SharedErrors, part: float) -> SharedErrors:
    north, east, down = shared.heading_ned_m
    return shared.model_copy(
        update={
            "heading_ned_m": (part * north, part * east, part * down),
            "heading_rad": part * shared.heading_rad,
        }
    )


def _exchanged(covariance: Matrix3, before: Vector3, after: Vector3) -> Matrix3:
    """A covariance with the outer product of one displacement instead of another's."""
    places = [(row, column) for row in range(3) for column in range(3)]
    return tuple(
        value - before[row] * before[column] + after[row] * after[column]
        for value, (row, column) in zip(covariance, places, strict=True)
    )
