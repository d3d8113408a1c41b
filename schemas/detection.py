"""What the detector saw in one frame."""

from typing import Annotated

from pydantic import Field

from schemas.message import Matrix6, Part, Quaternion, ShortText, Traced, Vector3

Corner = tuple[float, float]
RowsAfter = Annotated[float, Field(ge=-1.0, le=1.0)]


class MarkerPose(Part):
    """One of the two poses that a square's picture allows (IPPE). Marker frame: x right, y up, z out of the print."""

    position_camera_m: Vector3
    """The marker's centre in the camera frame (x right, y down, z forward), metres."""
    q_camera_marker: Quaternion
    """Takes marker coordinates to camera coordinates; w, x, y, z."""
    reprojection_error_px: Annotated[float, Field(ge=0.0)]
    """Root mean square distance between the seen and the reprojected corners, pixels."""
    covariance: Matrix6
    """Covariance of (position_camera_m, small rotation vector in the camera frame): m^2, m rad, rad^2."""


class Marker(Part):
    """One marker seen."""

    family: ShortText
    """Marker family, such as `5x5_1000`."""
    id: Annotated[int, Field(ge=0)]
    """The marker's number within its family."""
    side_m: Annotated[float, Field(gt=0.0)]
    """Length of the marker's black outer edge, metres."""
    corners_px: tuple[Corner, Corner, Corner, Corner]
    """Distorted pixel coordinates of the upper left, upper right, lower right and lower left corner of the print."""
    corner_sigma_px: Annotated[float, Field(gt=0.0)]
    """Standard deviation of one corner coordinate, pixels."""
    poses: Annotated[tuple[MarkerPose, ...], Field(max_length=2)] = ()
    """The planar solutions, the one with the smaller reprojection error first; none where they are those of `pad`, said there."""
    ambiguity: Annotated[float, Field(ge=0.0, le=1.0)]
    """Smaller over larger reprojection error: near 1 the picture cannot tell the two poses apart."""
    rows_after_s: RowsAfter = 0.0
    """From `captured_at_ns` to the exposure of the rows that show the marker's middle (rolling shutter), seconds."""


class MarkerName(Part):
    """Which marker."""

    family: ShortText
    """Marker family, such as `5x5_1000`."""
    id: Annotated[int, Field(ge=0)]
    """The marker's number within its family."""


class PadView(Part):
    """The pad as a whole: one pose from all of its markers that were found. Pad frame: x right, y up in the print, z out of it."""

    poses: Annotated[tuple[MarkerPose, ...], Field(min_length=1, max_length=2)]
    """The planar solutions for the pad's centre and print, the one with the smaller reprojection error first."""
    ambiguity: Annotated[float, Field(ge=0.0, le=1.0)]
    """Smaller over larger reprojection error: near 1 the picture cannot tell the two poses apart."""
    used: Annotated[tuple[MarkerName, ...], Field(min_length=1, max_length=256)]
    """The markers that the poses come from, largest first."""
    left_out: Annotated[tuple[MarkerName, ...], Field(max_length=256)] = ()
    """Markers of the pad that were found where they cannot be if the others are right."""
    extent_px: Annotated[float, Field(gt=0.0)]
    """How large the used corners' outline is in the picture: side of the square of its area, or mean side of a single marker, pixels."""
    corner_sigma_px: Annotated[float, Field(gt=0.0)]
    """Standard deviation of one corner coordinate, root mean square over the used markers, pixels."""
    rows_after_s: RowsAfter = 0.0
    """From `captured_at_ns` to the exposure of the rows that show the middle of the used markers' corners (rolling shutter), seconds:
    the poses are those of that moment."""


class Detection(Traced):
    """The markers found in one frame; published for a frame without any, too, so that silence means a fault."""

    frame_sequence: Annotated[int, Field(ge=0)]
    """`sequence` of the frame."""
    detector: ShortText
    """Name of the detector."""
    markers: Annotated[tuple[Marker, ...], Field(max_length=256)] = ()
    """The markers found, any order."""
    pad: PadView | None = None
    """The pad that the settings name; None if none of its markers was found, or if the detector does not say."""
