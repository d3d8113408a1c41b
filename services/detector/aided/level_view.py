"""The picture as a camera would see it that looks straight down at the pad, as large as the search wants it."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from services.detector.aided.marker_view import MarkerView
from services.detector.aided.pixel_rays import PixelRays
from services.detector.aided.search import Proposal
from services.detector.detector import GreyPicture

Array = NDArray[np.float64]

_STEEPEST_RAD = math.radians(60.0)
_LARGEST_PART = 1.6
"""How many times the pixels of the whole picture a levelled one may have."""
_FINE, _MARGIN_PX = 0.75, 12
_STRAIGHT_RAD = math.radians(2.0)


@dataclass(frozen=True)
class Region:
    """Where to search in the whole picture."""

    x_px: float
    y_px: float
    reach_px: float
    """Half the side of the square, pixels."""


@dataclass(frozen=True)
class LevelView:
    """A picture for the search, and the way back."""

    picture: GreyPicture
    rays: PixelRays
    R_camera_level: Array
    focal_px: float
    centre_px: tuple[float, float]

    def marker_view(self, proposal: Proposal, side_m: float) -> MarkerView:
        """The pose in the camera frame that a proposal means for a marker of that side."""
        depth_m = self.focal_px * side_m / proposal.side_px
        x, y = proposal.x_px - self.centre_px[0], proposal.y_px - self.centre_px[1]
        seen = self.rays.camera.matrix @ self.R_camera_level @ (x / self.focal_px, y / self.focal_px, 1.0)
        # The lens's distortion was left out of the turning: it bends the way back, not the marker.
        ray = self.rays.at(seen[None, :2] / seen[2])[0]
        ray_level = self.R_camera_level.T @ (ray[0], ray[1], 1.0)
        c, s = math.cos(proposal.yaw_rad), math.sin(proposal.yaw_rad)
        R = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])
        return MarkerView(self.R_camera_level @ R, self.R_camera_level @ (ray_level * depth_m / ray_level[2]))


def level_view(
    picture: GreyPicture, rays: PixelRays, normal_camera: Array, scale: float, region: Region | None
) -> LevelView | None:
    """Turn and scale a picture.

    Args:
        picture: (height, width), grey levels.
        rays: Of its camera.
        normal_camera: Unit vector out of the print, camera frame: the camera is turned until it looks against it.
        scale: Focal length of the new picture as a part of the camera's.
        region: What part to take; None for all.

    Returns:
        None if nothing of the region is in view.
    """
    camera = rays.camera
    focal_px = scale * (camera.fx_px + camera.fy_px) / 2.0
    angle_rad = math.acos(min(max(-float(normal_camera[2]), -1.0), 1.0))
    if angle_rad > _STEEPEST_RAD:
        normal_camera, angle_rad = np.array((0.0, 0.0, -1.0)), 0.0
    if angle_rad < _STRAIGHT_RAD and scale <= 1.0 and abs(camera.fx_px / camera.fy_px - 1.0) < 0.02:
        return _scaled(picture, rays, scale, region)
    R = _towards(-normal_camera)
    outline = _outline(camera, region)
    seen = np.column_stack((rays.at(outline), np.ones(len(outline)))) @ R
    seen = seen[np.isfinite(seen).all(axis=1) & (seen[:, 2] > 0.1)]
    if len(seen) < 3:
        return None
    plane = focal_px * seen[:, :2] / seen[:, 2:]
    low, high = np.floor(plane.min(axis=0)), np.ceil(plane.max(axis=0))
    width, height = (int(value) for value in (high - low + 1.0).tolist())
    if width * height > _LARGEST_PART * camera.width_px * camera.height_px * max(scale, 1.0) ** 2:
        return _scaled(picture, rays, min(scale, 1.0), region)
    A = np.array([[focal_px, 0.0, -low[0]], [0.0, focal_px, -low[1]], [0.0, 0.0, 1.0]])
    smaller, smaller_from_whole = _smaller(picture, outline, max(round(1.0 / scale), 1) if scale < _FINE else 1)
    source_from_level = smaller_from_whole @ camera.matrix @ R @ np.linalg.inv(A)
    turned = cv2.warpPerspective(
        smaller,
        source_from_level,
        (width, height),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return LevelView(np.asarray(turned, np.uint8), rays, R, focal_px, (-float(low[0]), -float(low[1])))


def _smaller(picture: GreyPicture, outline: Array, shrink: int) -> tuple[GreyPicture, Array]:
    """What lies within an outline (N, 2), with a margin, made smaller; and how it is come to from the whole, (3, 3)."""
    height, width = picture.shape
    margin = _MARGIN_PX * shrink
    left, top = (max(int(value - margin) // shrink * shrink, 0) for value in outline.min(axis=0).tolist())
    right, bottom = np.ceil(outline.max(axis=0) + margin).astype(int).tolist()
    columns = max((min(right, width) - left) // shrink, 1)
    rows = max((min(bottom, height) - top) // shrink, 1)
    part = picture[top : top + rows * shrink, left : left + columns * shrink]
    if shrink > 1:
        part = np.asarray(cv2.resize(part, (columns, rows), interpolation=cv2.INTER_AREA), np.uint8)
    half = (1.0 - 1.0 / shrink) / 2.0
    across, down = -left / shrink - half, -top / shrink - half
    return part, np.array([[1.0 / shrink, 0.0, across], [0.0, 1.0 / shrink, down], [0.0, 0.0, 1.0]])


def _scaled(picture: GreyPicture, rays: PixelRays, scale: float, region: Region | None) -> LevelView | None:
    """Without turning: cut out and shrink."""
    camera = rays.camera
    height, width = picture.shape
    left, top, right, bottom = 0, 0, width, height
    if region is not None:
        left, top = max(int(region.x_px - region.reach_px), 0), max(int(region.y_px - region.reach_px), 0)
        right = min(int(region.x_px + region.reach_px) + 1, width)
        bottom = min(int(region.y_px + region.reach_px) + 1, height)
    if right - left < 4 or bottom - top < 4:
        return None
    part = picture[top:bottom, left:right]
    if scale < 1.0:
        size = (max(round((right - left) * scale), 4), max(round((bottom - top) * scale), 4))
        part = np.asarray(cv2.resize(part, size, interpolation=cv2.INTER_AREA), np.uint8)
    x_scale = part.shape[1] / (right - left)
    centre = (
        (camera.cx_px - left + 0.5) * x_scale - 0.5,
        (camera.cy_px - top + 0.5) * part.shape[0] / (bottom - top) - 0.5,
    )
    return LevelView(part, rays, np.eye(3), x_scale * (camera.fx_px + camera.fy_px) / 2.0, centre)


def _outline(camera: PinholeCamera, region: Region | None) -> Array:
    low, high = np.zeros(2), np.array((camera.width_px - 1.0, camera.height_px - 1.0))
    if region is not None:
        middle = np.array((region.x_px, region.y_px))
        low, high = np.clip(middle - region.reach_px, low, high), np.clip(middle + region.reach_px, low, high)
    along = np.linspace(0.0, 1.0, 5)[:, None]
    corners = np.array([low, (high[0], low[1]), high, (low[0], high[1])])
    edges = [corners[i] + along * (corners[(i + 1) % 4] - corners[i]) for i in range(4)]
    return np.concatenate(edges)


def _towards(direction: Array) -> Array:
    """The smallest rotation that takes the optical axis to a direction: its columns are the level camera's axes, (3, 3)."""
    axis = np.cross((0.0, 0.0, 1.0), direction)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        return np.eye(3)
    return np.asarray(cv2.Rodrigues(axis / sine * math.atan2(sine, float(direction[2])))[0], float)
