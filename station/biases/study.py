"""Both models fitted to the same hovers."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from schemas.settings.geolocator import Correction, SurveyedHeading, SurveyedTilt
from schemas.settings.section import Section
from station.biases.corrected_hover import corrected_hover
from station.biases.cylindrical_fit import CylindricalFit, fit_cylindrical
from station.biases.extrinsic_fit import AUTOPILOT, REFERENCE, ExtrinsicFit, fit_extrinsic
from station.biases.recorded_hover import RecordedHover
from station.report.figures.static_records import StaticRecord

VARIANTS = ("mean", "median", "extrinsic")
BY_AUTOPILOT = "extrinsic, autopilot's attitude"
"""The variant that does not know the reference's attitude."""
ByPrint = Literal["nothing", "heading", "attitude"]
"""What is taken from how the pad's print is turned and tilted in the picture, and not from the autopilot alone."""


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

    def relocated(self, hover: RecordedHover, variant: str, by_print: ByPrint = "nothing") -> StaticRecord:
        """Any hover with one of the corrections, and with the autopilot's attitude or what the pad's print tells of it."""
        fit = self._extrinsic(variant)
        pad_down_m = 0.0 if fit is None else fit.value("pad_down_m")
        sections = self.print_sections(hover, fit or self.extrinsic, by_print)
        return corrected_hover(hover, self.correction(variant), pad_down_m, sections)

    def print_sections(self, hover: RecordedHover, fit: ExtrinsicFit, by_print: ByPrint) -> dict[str, Section]:
        """How the pad lies, as a fit found it, and how far the autopilot's attitude is to be trusted.

        The lie does not depend on the attitude: where the pad is seen and how it is turned there are off by the same. The attitude
        is trusted as far as it was right in the recordings of the fit, where that is known.
        """
        if by_print == "nothing":
            return {}
        sections: dict[str, Section] = {
            "heading": SurveyedHeading(
                pad_azimuth_deg=fit.value("pad_azimuth_deg"), sigma_deg=min(45.0, fit.sigma("pad_azimuth_deg"))
            )
        }
        if by_print == "attitude":
            names = ("pad_tilt_north_deg", "pad_tilt_east_deg")
            tilt_north_deg, tilt_east_deg = (fit.value(name) for name in names)
            sigma_deg = max(fit.sigma(name) for name in names)
            sections["tilt"] = SurveyedTilt(pad_tilt_deg=(tilt_north_deg, tilt_east_deg), sigma_deg=sigma_deg)
            tilt_deg, heading_deg = self._attitude_sigmas_deg(fit)
            told = {"roll_pitch_deg": tilt_deg, "mount_roll_pitch_deg": 0.0, "yaw_deg": heading_deg}
            sections["uncertainty"] = hover.settings.geolocator.uncertainty.model_copy(update=told)
        return sections

    def _attitude_sigmas_deg(self, fit: ExtrinsicFit) -> tuple[float, float]:
        """How far roll and pitch, and the heading, were off in the recordings of the fit; a priori where it knows no reference."""
        errors = [error for hover in self.hovers if (error := hover.attitude_error_deg()) is not None]
        if fit is self.by_autopilot or not errors:
            return AUTOPILOT.tilt_sigma_deg, AUTOPILOT.heading_sigma_deg
        squares = np.mean(np.concatenate(errors) ** 2, axis=0)
        return float(np.sqrt(squares[:2].mean())), float(np.sqrt(squares[2]))

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
