"""Both models fitted to the same hovers."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from schemas.settings.geolocator import Correction
from station.biases.corrected_hover import corrected_hover
from station.biases.cylindrical_fit import CylindricalFit, fit_cylindrical
from station.biases.extrinsic_fit import ExtrinsicFit, fit_extrinsic
from station.biases.recorded_hover import RecordedHover
from station.report.figures.static_records import StaticRecord

VARIANTS = ("mean", "median", "extrinsic")


@dataclass(frozen=True)
class Study:
    """What the fits found, and how the hovers look after each."""

    hovers: Sequence[RecordedHover]
    cylindrical: CylindricalFit
    extrinsic: ExtrinsicFit
    records: dict[str, list[StaticRecord]]
    """By `raw`, `mean`, `median` and `extrinsic`."""

    def correction(self, variant: str) -> Correction:
        """Of one of `VARIANTS`."""
        if variant == "extrinsic":
            return self.extrinsic.correction()
        return self.cylindrical.correction("median" if variant == "median" else "mean")

    def relocated(self, hover: RecordedHover, variant: str) -> StaticRecord:
        """Any hover with one of the corrections."""
        pad_down_m = self.extrinsic.value("pad_down_m") if variant == "extrinsic" else 0.0
        return corrected_hover(hover, self.correction(variant), pad_down_m)


def study_of(hovers: Sequence[RecordedHover]) -> Study:
    """Fit both models and apply them.

    Raises:
        FitError: In one line, if the hovers do not allow it.
    """
    cylindrical = fit_cylindrical([hover.static for hover in hovers])
    azimuth_deg = math.degrees(hovers[0].pad_azimuth_rad)
    extrinsic = fit_extrinsic([hover.sightings for hover in hovers], hovers[0].camera, azimuth_deg)
    study = Study(hovers, cylindrical, extrinsic, {"raw": [hover.static for hover in hovers]})
    for variant in VARIANTS:
        study.records[variant] = [study.relocated(hover, variant) for hover in hovers]
    return study
