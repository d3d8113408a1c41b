"""The pad in a detection: as the detector says it, or, where it does not, from the pad's largest marker."""

from alight.markers.layout import PadLayout
from alight.markers.pad_pose import mean_side_px, pad_pose
from schemas.detection import Detection, MarkerName, PadView
from schemas.fix import FixVerdict
from services.geolocator.refusal import FixRefusedError


def pad_in(detection: Detection, layout: PadLayout) -> PadView:
    """The pad as a whole.

    A detector from elsewhere may know nothing of layouts: then the pad's marker that is largest in the picture speaks for it.

    Raises:
        FixRefusedError: NO_MARKER if none of the pad's markers is among those seen.
    """
    if detection.pad is not None:
        return _believed(detection.pad, layout)
    placed = [(marker, layout.find(marker.family, marker.id)) for marker in detection.markers]
    candidates = [(marker, spot) for marker, spot in placed if spot is not None and marker.poses]
    if not candidates:
        wanted = ", ".join(f"{marker.family} {marker.id}" for marker in layout.markers)
        poseless = sum(not marker.poses for marker in detection.markers)
        raise FixRefusedError(
            FixVerdict.NO_MARKER,
            f"{wanted[:100]} is not among the {len(detection.markers)} markers seen"
            + (f" ({poseless} without a pose)" if poseless else ""),
        )
    marker, spot = max(candidates, key=lambda each: mean_side_px(each[0].corners_px))
    return PadView(
        poses=tuple(pad_pose(pose, spot) for pose in marker.poses),
        ambiguity=marker.ambiguity,
        used=(MarkerName(family=marker.family, id=marker.id),),
        extent_px=mean_side_px(marker.corners_px),
        corner_sigma_px=marker.corner_sigma_px,
        rows_after_s=marker.rows_after_s,
    )


def _believed(pad: PadView, layout: PadLayout) -> PadView:
    """A detector that was set up for another pad must not steer."""
    strange = [name for name in pad.used if layout.find(name.family, name.id) is None]
    if strange:
        raise FixRefusedError(
            FixVerdict.NO_MARKER,
            f"the detector's pad has {strange[0].family} {strange[0].id}, which is not in this layout",
        )
    return pad
