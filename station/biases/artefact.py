"""The file that a fit leaves: the correction as the geolocator reads it, and how it came about."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from schemas.settings.geolocator import Correction
from services.geolocator.correction_file import VERSION
from station.biases.cylindrical_fit import REJECTED_R2, CylindricalFit
from station.biases.extrinsic_fit import ExtrinsicFit
from station.biases.extrinsic_model import NAMES
from station.biases.quality import Quality
from station.biases.recorded_hover import RecordedHover

_CONVENTION = (
    "Biases are measured minus true and are subtracted. Angles are azimuths from north, clockwise (the paper's are from east: other sign). "
    "beta_d_m is of the height above the pad: positive is measured too high."
)


def data_digest(hovers: Sequence[RecordedHover]) -> str:
    """SHA-256 of the samples that the fit saw, 16 hexadecimal digits: the same data, the same digest."""
    digest = hashlib.sha256()
    for hover in hovers:
        for array in (hover.static.true_ned_m, hover.static.measured_ned_m, hover.sightings.corners_px):
            digest.update(array.tobytes())
    return digest.hexdigest()[:16]


def cylindrical_facts(fit: CylindricalFit) -> dict[str, float | int | str]:
    """What is worth knowing of the paper's model."""
    verdict = (
        "rejected"
        if fit.angular_line.r2 <= REJECTED_R2
        else "explains more than the paper's: the model lacks something"
    )
    return {
        "positions": fit.positions,
        "records": fit.records,
        "samples": fit.samples,
        "radial_line_r2": fit.radial_line.r2,
        "angular_line_r2": fit.angular_line.r2,
        "angular_line": verdict,
    }


def extrinsic_facts(fit: ExtrinsicFit) -> dict[str, float | int | str]:
    """What is worth knowing of ours: every parameter with its standard deviation."""
    facts: dict[str, float | int | str] = {
        "frames": fit.frames,
        "rms_before_px": fit.rms_before_px,
        "rms_px": fit.rms_px,
    }
    for name, value, sigma in zip(NAMES, fit.values.tolist(), fit.sigmas.tolist(), strict=True):
        facts |= {name: value, f"{name}_sigma": sigma}
    return facts


def artefact_text(
    correction: Correction,
    method: str,
    digest: str,
    facts: Mapping[str, float | int | str],
    quality: Mapping[str, Quality],
    warnings: Sequence[str] = (),
) -> str:
    """The file, TOML.

    Args:
        correction: What the geolocator applies.
        method: Model and variant, such as `cylindrical, mean`.
        digest: From `data_digest`.
        facts: Of the fit.
        quality: `before` and `after`.
        warnings: What the flights do not show.
    """
    lines = [f"version = {VERSION}", "", "[correction]"]
    plain = correction.model_dump(mode="json")
    extrinsic = plain.pop("extrinsic")
    lines += _keys(plain)
    if correction.method == "extrinsic":
        lines += ["", "[correction.extrinsic]", *_keys(extrinsic)]
    lines += ["", "[fit]", *_keys({"method": method, "convention": _CONVENTION, "data_sha256": digest, **facts})]
    lines.append(f"warnings = {json.dumps(list(warnings), ensure_ascii=False)}")
    for name, one in quality.items():
        lines += ["", f"[fit.{name}]  # errors of the samples of the fit, north, east, down, metres"]
        for key in ("mean_m", "sigma_m", "rmse_m"):
            lines.append(f"{key} = {[round(value, 5) for value in getattr(one, key).tolist()]}")
    return "\n".join(lines) + "\n"


def write_artefact(path: Path, text: str) -> None:
    """Write it; folders are made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def _keys(table: Mapping[str, float | int | str | bool]) -> list[str]:
    return [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in table.items()]
