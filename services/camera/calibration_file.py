"""Camera calibrations in files: our TOML, read and written, and the YAML that OpenCV's own programs write."""

import json
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from pydantic import ValidationError

from schemas.calibration import CameraCalibration
from schemas.settings.camera import Calibration, CameraSettings

_REMEDY = "give width_px, height_px, fx_px, fy_px, cx_px, cy_px and distortion = [k1, k2, p1, p2, k3]"
_KEYS = ("width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px")


class CalibrationError(ValueError):
    """A calibration that cannot be used: file, key and remedy in one line."""


def configured_calibration(settings: CameraSettings) -> CameraCalibration:
    """The calibration that the settings give, from the file they name or their own section.

    Raises:
        CalibrationError: If the file is missing or wrong.
    """
    if settings.calibration_file:
        return read_calibration(Path(settings.calibration_file), key="camera.calibration_file")
    return CameraCalibration(at_ns=0, **settings.calibration.model_dump())


def read_calibration(path: Path, key: str, size_px: tuple[int, int] | None = None) -> CameraCalibration:
    """Read a calibration; `at_ns` is 0.

    Args:
        path: A `.toml` file with the keys of `Calibration`, all but `distortion`, `row_time_s` and `source` required, or OpenCV YAML with
            `camera_matrix` and `distortion_coefficients`.
        key: The setting or option that named the file, for the message.
        size_px: Width and height for a YAML file without `image_width` and `image_height`.

    Raises:
        CalibrationError: If it is missing or wrong.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not a text file"
        raise CalibrationError(f"{path}: cannot be read ({reason}): correct {key}") from None
    table = _from_yaml(path, text, size_px) if path.suffix in (".yml", ".yaml") else _from_toml(path, text)
    missing = [name for name in _KEYS if name not in table]
    if missing:
        raise CalibrationError(f"{path}: {missing[0]} is missing: {_REMEDY}")
    try:
        checked = Calibration.model_validate({"source": path.name, **table})
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        name = ".".join(str(part) for part in first["loc"])
        raise CalibrationError(f"{path}: {name}: {first['msg']} (got {first['input']!r}): {_REMEDY}") from None
    return CameraCalibration(at_ns=0, **checked.model_dump())


def calibration_text(calibration: Calibration, remarks: Sequence[str] = ()) -> str:
    """A calibration as the TOML file that `read_calibration` reads.

    Args:
        calibration: The numbers.
        remarks: Lines for people, put before them.
    """
    lines = [f"# {line}" for line in remarks]
    lines += [f"{key} = {getattr(calibration, key)!r}" for key in _KEYS]
    lines.append(f"distortion = {list(calibration.distortion)!r}")
    if calibration.row_time_s:
        lines.append(f"row_time_s = {calibration.row_time_s!r}")
    lines.append(f"source = {json.dumps(calibration.source)}")
    return "\n".join(lines) + "\n"


def scaled_to(calibration: CameraCalibration, width_px: int, height_px: int) -> CameraCalibration:
    """The same camera giving pictures of another size, where the whole sensor is binned or scaled and nothing is cut off.

    Raises:
        CalibrationError: If the shape differs, so that something was cut off.
    """
    across, down = width_px / calibration.width_px, height_px / calibration.height_px
    # One pixel more or less is rounding.
    if abs(calibration.height_px * across - height_px) > 1.0:
        raise CalibrationError(
            f"pictures are {width_px}x{height_px}, the calibration is for {calibration.width_px}x{calibration.height_px}: "
            "another shape, so something was cut off; calibrate at the size that is flown"
        )
    return calibration.model_copy(
        update={
            "width_px": width_px,
            "height_px": height_px,
            "fx_px": calibration.fx_px * across,
            "fy_px": calibration.fy_px * down,
            # Pixels are counted from the centre of the first one.
            "cx_px": (calibration.cx_px + 0.5) * across - 0.5,
            "cy_px": (calibration.cy_px + 0.5) * down - 0.5,
            "row_time_s": calibration.row_time_s / down,
        }
    )


def _from_toml(path: Path, text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise CalibrationError(f"{path}: not valid TOML: {error}: {_REMEDY}") from None


def _from_yaml(path: Path, text: str, size_px: tuple[int, int] | None) -> dict[str, Any]:
    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        matrix = np.asarray(storage.getNode("camera_matrix").mat())
        distortion = np.asarray(storage.getNode("distortion_coefficients").mat())
        stored = [int(storage.getNode(name).real()) for name in ("image_width", "image_height")]
    except (cv2.error, SystemError):
        matrix, distortion, stored = np.empty(0), np.empty(0), [0, 0]
    if matrix.shape != (3, 3) or not 4 <= distortion.size <= 5:
        raise CalibrationError(f"{path}: no camera_matrix (3x3) and distortion_coefficients (4 or 5): write it as TOML")
    width, height = stored if all(stored) else (size_px or (0, 0))
    coefficients = [*distortion.ravel().tolist(), 0.0][:5]
    focal = {"fx_px": matrix[0, 0], "fy_px": matrix[1, 1], "cx_px": matrix[0, 2], "cy_px": matrix[1, 2]}
    return {"width_px": width, "height_px": height, **focal, "distortion": coefficients}
