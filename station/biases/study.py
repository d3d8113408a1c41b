"""Both models fitted to the same hovers."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

from schemas.settings.geolocator import Correction, SurveyedHeading
from station.biases.corrected_hover import corrected_hover
from station.biases.cylindrical_fit import CylindricalFit, fit_cylindrical
from station.biases.extrinsic_fit import REFERENCE, ExtrinsicFit, fit_extrinsic
from station.biases.extrinsic_model import NAMES
from station.biases.recorded_hover import RecordedHover
from station.report.figures.static_records import StaticRecord

VARIANTS = ("mean", "median", "extrinsic")
BY_AUTOPILOT = "extrinsic, autopilot's attitude"
"""The variant that does not know the reference's attitude."""


@dataclass(frozen=True)
class Study:
    """What the fits found, and how the hovers look after each."""

    hovers: Sequence[RecordedHover]
    cylindrical: CylindricalFit
    extrinsic: ExtrinsicFit
    """With the reference's attitude, where the recordings have it; otherwise with the autopilot's."""
    by_autopilot: ExtrinsicFit | None
    """With the autopilot's attitude, as on a field without motion capture; None where `extrinsic` is that already."""
    records: dict[str, list[StaticRecord]]
    """By `raw`, `mean`, `median` and `extrinsic`."""

    def correction(self, variant: str) -> Correction:
        """Of one of `VARIANTS`, or `BY_AUTOPILOT`."""
        fit = self._extrinsic(variant)
        if fit is not None:
            return fit.correction()
        return self.cylindrical.correction("median" if variant == "median" else "mean")

    def relocated(self, hover: RecordedHover, variant: str, *, heading_by_pad: bool = False) -> StaticRecord:
        """Any hover with one of the corrections, with the compass's heading or with that of the pad's print."""
        fit = self._extrinsic(variant)
        heading = self.surveyed_heading(fit or self.extrinsic) if heading_by_pad else SurveyedHeading()
        pad_down_m = 0.0 if fit is None else fit.value("pad_down_m")
        return corrected_hover(hover, self.correction(variant), pad_down_m, heading)

    @staticmethod
    def surveyed_heading(fit: ExtrinsicFit) -> SurveyedHeading:
        """How the pad is turned, as a fit found it: where it is seen and how it is turned there are off by the same heading."""
        sigma_deg = float(fit.sigmas[NAMES.index("pad_azimuth_deg")])
        return SurveyedHeading(pad_azimuth_deg=fit.value("pad_azimuth_deg"), sigma_deg=min(45.0, sigma_deg))

    def _extrinsic(self, variant: str) -> ExtrinsicFit | None:
        return {"extrinsic": self.extrinsic, BY_AUTOPILOT: self.by_autopilot}.get(variant)


def study_of(hovers: Sequence[RecordedHover]) -> Study:
    """Fit both models and apply them.

    Raises:
        FitError: In one line, if the hovers do not allow it.
    """
    cylindrical = fit_cylindrical([hover.static for hover in hovers])
    extrinsic, by_autopilot = _extrinsic_fits(hovers)
    study = Study(hovers, cylindrical, extrinsic, by_autopilot, {"raw": [hover.static for hover in hovers]})
    for variant in VARIANTS:
        study.records[variant] = [study.relocated(hover, variant) for hover in hovers]
    return study


def _extrinsic_fits(hovers: Sequence[RecordedHover]) -> tuple[ExtrinsicFit, ExtrinsicFit | None]:
    """With the reference's attitude and with the autopilot's; only the latter where the recordings know no other."""
    camera, azimuth_deg = hovers[0].camera, math.degrees(hovers[0].pad_azimuth_rad)
    by_autopilot = fit_extrinsic([hover.sightings for hover in hovers], camera, azimuth_deg)
    attitudes = [hover.true_attitude for hover in hovers if hover.true_attitude is not None]
    if len(attitudes) < len(hovers):
        return by_autopilot, None
    referred = [
        dataclasses.replace(hover.sightings, attitude=attitude)
        for hover, attitude in zip(hovers, attitudes, strict=True)
    ]
    return fit_extrinsic(referred, camera, azimuth_deg, REFERENCE), by_autopilot
