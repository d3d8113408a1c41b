"""A hover as today's geolocator locates it with a correction."""

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from schemas.settings.geolocator import Correction
from schemas.settings.section import Section
from station.biases.extrinsic_model import rotation_matrices
from station.biases.recorded_hover import RecordedHover, settled, static_record
from station.biases.sightings import Array
from station.experiment.refilter import relocated_fixes
from station.report.figures.static_records import StaticRecord


def corrected_hover(
    hover: RecordedHover,
    correction: Correction,
    pad_down_m: float = 0.0,
    by_print: Mapping[str, Section] = MappingProxyType({}),
) -> StaticRecord:
    """The recorded detections through the geolocator with a correction.

    Args:
        hover: The hover.
        correction: What the geolocator shall apply.
        pad_down_m: How much lower than surveyed the pad is known to lie: taken off, since the reference counts from the survey.
        by_print: Sections `heading`, `tilt` and `uncertainty` of the geolocator, if it shall take the attitude from the pad.
    """
    changed = {"correction": correction, "correction_file": "", **by_print}
    geolocator = hover.settings.geolocator.model_copy(update=changed)
    settings = hover.settings.model_copy(update={"geolocator": geolocator})
    fixes = [logged.message for logged in relocated_fixes(hover.record, settings, "capture")]
    record = static_record(settled(fixes, hover.epoch_ns)[: hover.most], "corrected", hover.reference, hover.epoch_ns)
    return dataclasses.replace(record, measured_ned_m=np.add(record.measured_ned_m, (0.0, 0.0, pad_down_m)))


def with_true_attitude(hover: RecordedHover, record: StaticRecord) -> StaticRecord:
    """The same with the autopilot's attitude error taken out of it: what is left is the installation's and the detector's.

    Raises:
        ValueError: If the recording has no ground truth.
    """
    if hover.true_attitude is None:
        raise ValueError("the recording has no ground truth")
    at_s = hover.sightings.captured_s[: len(record.measured_ned_m)]
    believed = rotation_matrices(hover.sightings.attitude.at(at_s))
    true = rotation_matrices(hover.true_attitude.at(at_s))
    in_body: Array = np.einsum("nij,ni->nj", believed, record.measured_ned_m)
    return dataclasses.replace(record, measured_ned_m=np.einsum("nij,nj->ni", true, in_body))
