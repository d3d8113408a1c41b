"""`alight detect --context FILE`: what was known of the pad beforehand, picture by picture."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from alight.geometry.rotation import quaternion_normalised
from services.detector.detector import Prior

PriorFor = Callable[[Path, int | None], Prior | None]

_HEIGHT_SIGMA_PART = 0.05
_SURE_QUATERNION = 0.01


class ContextError(ValueError):
    """A context that cannot be used: file, line and reason in one line."""


class ContextLine(BaseModel):
    """One line of JSON; all but the name may be absent."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    name: str
    """The picture's file name, with or without its folder."""
    frame: int | None = None
    """Number of a video's frame; absent: all of them."""
    height_m: Annotated[float, Field(gt=0.0, le=1e4)] | None = None
    """Of the camera above the pad, metres."""
    height_sigma_m: Annotated[float, Field(gt=0.0)] | None = None
    """Its standard deviation, metres; absent: 5 % of the height."""
    q_ned_camera: tuple[float, float, float, float] | None = None
    """The camera's attitude, camera (x right, y down, z forward) to NED; w, x, y, z."""
    attitude_sigma_deg: Annotated[float, Field(gt=0.0, le=90.0)] = 2.0
    """Its standard deviation, degrees."""
    centre_px: tuple[float, float] | None = None
    """Where the pad's centre should be, pixels; the upper left pixel's centre is (0, 0)."""
    centre_sigma_px: Annotated[float, Field(gt=0.0)] = 20.0
    """Its standard deviation, pixels."""
    azimuth_deg: float | None = None
    """Azimuth of the print's upward direction, degrees."""
    azimuth_sigma_deg: Annotated[float, Field(gt=0.0)] = 10.0
    """Its standard deviation, degrees."""

    def prior(self) -> Prior:
        """As detectors take it.

        Raises:
            ValueError: If the quaternion is no rotation.
        """
        q = None
        if self.q_ned_camera is not None:
            if abs(math.hypot(*self.q_ned_camera) - 1.0) > _SURE_QUATERNION:
                raise ValueError("q_ned_camera is no unit quaternion (w, x, y, z)")
            q = quaternion_normalised(self.q_ned_camera)
        height_sigma_m = self.height_sigma_m or _HEIGHT_SIGMA_PART * (self.height_m or 0.0)
        return Prior(
            height_m=self.height_m,
            height_sigma_m=height_sigma_m,
            q_ned_camera=q,
            attitude_sigma_rad=math.radians(self.attitude_sigma_deg),
            centre_px=self.centre_px,
            centre_sigma_px=self.centre_sigma_px,
            azimuth_rad=None if self.azimuth_deg is None else math.radians(self.azimuth_deg),
            azimuth_sigma_rad=math.radians(self.azimuth_sigma_deg),
        )


def read_context(path: Path | None) -> PriorFor:
    """The prior of each picture by its name; of two lines for one, the later counts.

    Raises:
        ContextError: If the file cannot be read or used.
    """
    priors: dict[tuple[str, int | None], Prior] = {}
    for number, line in enumerate(_lines(path), start=1):
        if not line.strip():
            continue
        try:
            context = ContextLine.model_validate_json(line)
            priors[context.name, context.frame] = context.prior()
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            key = ".".join(str(part) for part in first["loc"])
            raise ContextError(f"--context {path}, line {number}: {key or 'line'}: {first['msg']}") from None
        except ValueError as error:
            raise ContextError(f"--context {path}, line {number}: {error}") from None

    def prior_for(file: Path, frame: int | None) -> Prior | None:
        keys = [(name, which) for which in (frame, None) for name in (str(file), file.name)]
        return next((priors[key] for key in keys if key in priors), None)

    return prior_for


def _lines(path: Path | None) -> list[str]:
    if path is None:
        return []
    try:
        return path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ContextError(f"--context {path}: cannot be read ({error})") from None
