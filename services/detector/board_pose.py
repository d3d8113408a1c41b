"""The pad's pose from all of its markers that were found; those that lie where they cannot are left out."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from alight.markers.layout import PadLayout, PlacedMarker
from alight.markers.pad_pose import mean_side_px, pad_pose
from schemas.detection import Marker, MarkerName, MarkerPose, PadView
from services.detector.planar_pose import PlanarPose, SeenPoints, planar_poses, predicted

Array = NDArray[np.float64]
Member = tuple[Marker, PlacedMarker]

_MOST_SEEDS = 6
_AGREES_SIGMAS = 5.0
_SLACK_PX = 0.3
"""What a corner may be off beyond its noise: prints are not quite flat, and noise is not quite Gaussian."""


def pad_view(markers: Sequence[Marker], layout: PadLayout, camera: PinholeCamera) -> PadView | None:
    """The pad, if any of its markers is there.

    Args:
        markers: All markers found in the frame, with their poses.
        layout: The pad.
        camera: The calibrated camera.
    """
    members = _members(markers, layout)
    if not members:
        return None
    kept, fitted = _consistent(members, camera)
    if fitted:
        poses = tuple(sorted((pose.as_message() for pose in fitted), key=lambda pose: pose.reprojection_error_px))
        ambiguity, extent_px, sigma_px = _ambiguity(poses), _extent_px(kept), _sigma_px(kept)
    else:
        marker, placed = kept[0]
        poses = tuple(pad_pose(pose, placed) for pose in marker.poses)
        ambiguity, extent_px, sigma_px = marker.ambiguity, mean_side_px(marker.corners_px), marker.corner_sigma_px
    names = tuple(_name(marker) for marker, _ in kept)
    left_out = tuple(_name(marker) for marker, _ in members if _name(marker) not in names)
    rows_after_s = sum(marker.rows_after_s for marker, _ in kept) / len(kept)
    return PadView(
        poses=poses,
        ambiguity=ambiguity,
        used=names,
        left_out=left_out,
        extent_px=extent_px,
        corner_sigma_px=sigma_px,
        rows_after_s=rows_after_s,
    )


def said_once(markers: Sequence[Marker], pad: PadView) -> tuple[Marker, ...]:
    """The markers, without the poses that the pad has from one of them as they are: they are most of what a detection weighs."""
    return tuple(marker.model_copy(update={"poses": ()}) if marker.poses == pad.poses else marker for marker in markers)


def _members(markers: Sequence[Marker], layout: PadLayout) -> list[Member]:
    """The pad's markers, largest in the picture first; of two alike the larger one."""
    by_name: dict[tuple[str, int], Member] = {}
    for marker in sorted(markers, key=lambda each: mean_side_px(each.corners_px)):
        placed = layout.find(marker.family, marker.id)
        if placed is not None:
            by_name[marker.family, marker.id] = (marker, placed)
    return sorted(by_name.values(), key=lambda member: -mean_side_px(member[0].corners_px))


def _consistent(members: list[Member], camera: PinholeCamera) -> tuple[list[Member], tuple[PlanarPose, ...]]:
    """The largest group of markers that may be on one pad together, the members' order kept, and its poses if it is not one alone.

    Usually that is all of them, and their common pose shows it. Else every marker in turn says where the others should be,
    and the one that most others agree with decides.
    """
    poses = _fitted(members, camera)
    if len(members) == 1 or (poses and max(_misfits(members, poses[0])) <= 1.0):
        return members, poses
    groups = [_agreeing(seed, members, camera) for seed in members[:_MOST_SEEDS]]
    group = max(groups, key=lambda each: (len(each), sum(mean_side_px(marker.corners_px) for marker, _ in each)))
    while len(group) > 1:
        poses = _fitted(group, camera)
        misfits = _misfits(group, poses[0]) if poses else [0.0] * len(group)
        if poses and max(misfits) <= 1.0:
            return group, poses
        # Of two that disagree the larger one stays, it shows more.
        worst = misfits.index(max(misfits)) if len(group) > 2 and poses else len(group) - 1
        group = group[:worst] + group[worst + 1 :]
    return group, ()


def _misfits(members: list[Member], pose: PlanarPose) -> list[float]:
    """For each marker its largest residual as a part of what is allowed."""
    largest = np.abs(pose.residuals_px).reshape(len(members), 8).max(axis=1)
    allowed = [_AGREES_SIGMAS * marker.corner_sigma_px + _SLACK_PX for marker, _ in members]
    return [float(value) for value in largest / allowed]


def _agreeing(seed: Member, members: list[Member], camera: PinholeCamera) -> list[Member]:
    """The markers that are where one of the seed's poses puts them, for all that the seed can tell; the seed included."""
    best: list[Member] = [seed]
    for pose in planar_poses(_seen([seed]), camera):
        group = [member for member in members if member is seed or _agrees(member, pose, camera)]
        best = max(best, group, key=len)
    return best


def _agrees(member: Member, pose: PlanarPose, camera: PinholeCamera) -> bool:
    marker, placed = member
    pixels, covariances = predicted(pose, placed.corners_m(), camera)
    variance = np.diagonal(covariances, axis1=1, axis2=2) + marker.corner_sigma_px**2
    off = np.abs(pixels - np.array(marker.corners_px))
    return bool(np.isfinite(off).all() and (off <= _AGREES_SIGMAS * np.sqrt(variance) + _SLACK_PX).all())


def _fitted(members: list[Member], camera: PinholeCamera) -> tuple[PlanarPose, ...]:
    return planar_poses(_seen(members), camera) if len(members) > 1 else ()


def _seen(members: list[Member]) -> SeenPoints:
    return SeenPoints(
        points_m=np.concatenate([placed.corners_m() for _, placed in members]),
        pixels=np.concatenate([np.array(marker.corners_px) for marker, _ in members]),
        sigma_px=np.repeat([marker.corner_sigma_px for marker, _ in members], 4),
    )


def _ambiguity(poses: tuple[MarkerPose, ...]) -> float:
    if len(poses) == 1:
        return 0.0
    errors = sorted(pose.reprojection_error_px for pose in poses)
    return errors[0] / errors[1] if errors[1] > 0.0 else 1.0


def _extent_px(members: list[Member]) -> float:
    """Side of the square that is as large as the outline of all corners."""
    corners = np.concatenate([np.array(marker.corners_px) for marker, _ in members]).astype(np.float32)
    return max(1.0, float(np.sqrt(cv2.contourArea(cv2.convexHull(corners)))))


def _sigma_px(members: list[Member]) -> float:
    return float(np.sqrt(np.mean([marker.corner_sigma_px**2 for marker, _ in members])))


def _name(marker: Marker) -> MarkerName:
    return MarkerName(family=marker.family, id=marker.id)
