"""Sun on the scene: the edge of a shadow over the ground, and a highlight where ground or print mirror the sun."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from schemas.settings.camera import Sunlight
from services.camera.ray_grid import Grid, enlarged
from services.camera.viewpoint import Viewpoint

Picture = NDArray[np.uint8]


def _marker_direction(azimuth_deg: float, pad_azimuth_rad: float) -> tuple[float, float]:
    """Marker x and y of a horizontal unit vector."""
    angle = math.radians(azimuth_deg) - pad_azimuth_rad
    return math.sin(angle), math.cos(angle)


def with_shadow(picture: Picture, ground_m: Grid, pad_azimuth_rad: float, sunlight: Sunlight) -> Picture:
    """Darken what lies in the shadow.

    Args:
        picture: The scene, grey levels.
        ground_m: Where the grid's rays meet the ground, marker x and y, metres.
        pad_azimuth_rad: Azimuth of the marker's y axis.
        sunlight: Where the edge runs and how dark it is.
    """
    if sunlight.shadow_depth <= 0.0:
        return picture
    x, y = _marker_direction(sunlight.shadow_azimuth_deg, pad_azimuth_rad)
    beyond_m = (
        ground_m[..., 0] * np.float32(x) + ground_m[..., 1] * np.float32(y) - np.float32(sunlight.shadow_offset_m)
    )
    inside = np.clip(enlarged(beyond_m) / np.float32(sunlight.shadow_edge_m) + np.float32(0.5), 0.0, 1.0)
    light = np.rint(255.0 * (1.0 - sunlight.shadow_depth * inside)).astype(np.uint8)
    rows, columns = picture.shape
    return np.asarray(cv2.multiply(picture, light[:rows, :columns], scale=1.0 / 255.0), np.uint8)


def with_glare(
    picture: Picture, rays: Grid, viewpoint: Viewpoint, pad_azimuth_rad: float, sunlight: Sunlight
) -> Picture:
    """Add the highlight: brightest along the ray that a level mirror would send to the sun."""
    if sunlight.glare_level <= 0.0:
        return picture
    x, y = _marker_direction(sunlight.azimuth_deg, pad_azimuth_rad)
    level, up = math.cos(math.radians(sunlight.elevation_deg)), math.sin(math.radians(sunlight.elevation_deg))
    mirrored = viewpoint.R_marker_camera.T @ np.array((x * level, y * level, -up))
    cosine = rays @ mirrored.astype(np.float32) / np.linalg.norm(rays, axis=-1)
    angle_rad = np.arccos(np.clip(cosine, -1.0, 1.0))
    width_rad = math.radians(sunlight.glare_width_deg)
    glare = sunlight.glare_level * np.exp(-0.5 * (angle_rad / width_rad) ** 2)
    rows, columns = picture.shape
    added = np.rint(enlarged(glare.astype(np.float32))).astype(np.uint8)[:rows, :columns]
    return np.asarray(cv2.add(picture, np.ascontiguousarray(added)), np.uint8)
