"""The pad: what is printed on it."""

from typing import Annotated

from pydantic import Field

from schemas.settings.section import Section


class PadSettings(Section):
    """A layout of markers, or one square marker. Defaults are the paper's pad (Section 4.1)."""

    layout: Annotated[str, Field(max_length=500)] = ""
    """Name of a shipped layout (`charuco`, `nested`, `paper`) or path of a TOML file; empty for the single marker that the keys below describe,
    which a layout leaves unused."""
    family: str = "5x5_1000"
    """Marker family: an OpenCV ArUco dictionary such as `5x5_1000`, or `apriltag_36h11`."""
    id: Annotated[int, Field(ge=0)] = 68
    """The marker's number in its family."""
    side_m: Annotated[float, Field(gt=0.0, le=100.0)] = 1.0
    """Length of the marker's black outer edge, metres."""
