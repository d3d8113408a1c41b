"""The paper's error model, fitted to hovers (Section 4.2, Eq. 21-26)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from schemas.settings.geolocator import Correction
from services.geolocator.correction import corrected_vector
from station.biases.line_fit import Array, Line, fitted_line
from station.report.figures.static_records import StaticRecord

Centre = Literal["mean", "median"]

REJECTED_R2 = 0.35
"""A line through the angular error that explains no more is rejected, as the paper does; one that explains more asks for another model."""

NEAR_M = 0.3
"""Nearer to the pad's centre than this a hover has no azimuth that means anything."""


class FitError(ValueError):
    """Hovers that do not show the biases, in one line with the remedy."""


@dataclass(frozen=True)
class Spread:
    """One row of Table 3 for each statistic: the samples of all hovers together."""

    mean: float
    median: float
    variance: float

    @classmethod
    def of(cls, samples: Array) -> "Spread":
        """Of samples (N,)."""
        return cls(float(samples.mean()), float(np.median(samples)), float(samples.var()))

    def centre(self, centre: Centre) -> float:
        """The mean or the median."""
        return self.mean if centre == "mean" else self.median


@dataclass(frozen=True)
class CylindricalFit:
    """Biases, each measured minus true: azimuth from north, horizontal distance, height above the pad."""

    azimuth_deg: Spread
    """Of the hovers beside the pad; above its centre there is no azimuth."""
    radius_m: Spread
    height_m: Spread
    radial_line: Line
    """Error of the distance over the distance, through the centroids of the positions, metres."""
    angular_line: Line
    """The same of the azimuth, degrees; tested, as in the paper, and not used."""
    positions: int
    records: int
    samples: int

    def correction(self, centre: Centre) -> Correction:
        """What the geolocator subtracts (Eq. 24), with the constant biases by the mean or by the median."""
        return Correction(
            method="cylindrical",
            theta_deg=self.azimuth_deg.centre(centre),
            alpha_r=self.radial_line.slope,
            beta_r_m=self.radial_line.offset,
            beta_d_m=self.height_m.centre(centre),
        )


def fit_cylindrical(records: Sequence[StaticRecord]) -> CylindricalFit:
    """Fit the model.

    Args:
        records: Hovers, some of them beside the pad, at two distances at least.

    Raises:
        FitError: If they are at fewer than three positions, or all at one distance.
    """
    groups = _by_position(records)
    beside = [group for group in groups if group[0].distance_m > NEAR_M]
    if len(groups) < 3 or not beside:
        raise FitError(f"{len(groups)} positions do not show the biases: hover at three or more, at several distances")
    distances_m = np.array([group[0].distance_m for group in groups])
    radial_m = [np.concatenate([record.cylindrical_error[1] for record in group]) for group in groups]
    angular_deg = [np.degrees(np.concatenate([record.cylindrical_error[0] for record in group])) for group in beside]
    try:
        radial = fitted_line(distances_m, np.array([error_m.mean() for error_m in radial_m]))
        aside_m = np.array([group[0].distance_m for group in beside])
        angular = (
            fitted_line(aside_m, np.array([error_deg.mean() for error_deg in angular_deg]))
            if np.ptp(aside_m) > 0.0
            else Line(0.0, float(np.concatenate(angular_deg).mean()), 0.0)
        )
    except ValueError as error:
        raise FitError(f"the hovers are all at one distance from the pad: {error}") from None
    # Positions are the vehicle's from the pad: a height that is too large is a down coordinate that is too small.
    height_m = np.concatenate([-record.error_ned_m[:, 2] for record in records])
    return CylindricalFit(
        Spread.of(np.concatenate(angular_deg)),
        Spread.of(np.concatenate(radial_m)),
        Spread.of(height_m),
        radial,
        angular,
        positions=len(groups),
        records=len(records),
        samples=len(height_m),
    )


def corrected_record(record: StaticRecord, correction: Correction) -> StaticRecord:
    """The hover as the geolocator would have measured it with a correction; it corrects the vector from vehicle to pad."""
    corrected = [corrected_vector((-n, -e, -d), correction) for n, e, d in record.measured_ned_m.tolist()]
    return StaticRecord(record.true_ned_m, -np.array(corrected).reshape(-1, 3), record.navigated_ned_m)


def _by_position(records: Sequence[StaticRecord]) -> list[list[StaticRecord]]:
    """Records of one place together: those whose references are the same to within a hover's accuracy."""
    groups: list[list[StaticRecord]] = []
    for record in records:
        for group in groups:
            if math.dist(group[0].true_ned_m.tolist(), record.true_ned_m.tolist()) < 0.5:
                group.append(record)
                break
        else:
            groups.append([record])
    return groups
