"""What the true camera sees: the pad on its ground, lit, before lens blur and sensor."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from services.camera.ground import COARSE_TEXEL_M, MEAN_LEVEL, Ground
from services.camera.print_on_ground import PrintOnGround
from services.camera.ray_grid import STEP_PX, Grid, RayGrid, enlarged
from services.camera.sensor import PIXEL_VARIANCE_PX2
from services.camera.sheet import BLUR_TEXELS, Sheet
from services.camera.viewpoint import Viewpoint

Picture = NDArray[np.uint8]

_SKY_LEVEL = 190
_LOWEST_SINE = 0.02
_TEXELS_A_PIXEL = 2.5
_TEXEL_VARIANCE = 0.25
"""Variance of a texel's area (1/12) and of interpolating between texels (1/6), texels squared."""
_BAND_ROWS = 8
_SAFE_PART = 0.98
"""The board's very edge is soft."""


@dataclass(frozen=True)
class Scene:
    """A rendered picture that still lacks the lens's blur."""

    picture: Picture
    """(height, width), grey levels."""
    blur_px2: float
    """Variance, along one axis, of the blur that the pad's sampling already brought, pixels squared."""


@dataclass(frozen=True)
class _Box:
    """Blocks of the grid, the last ones excluded."""

    left: int
    top: int
    right: int
    bottom: int
    side_px: float
    """Mean length of the sheet's sides in the picture, pixels."""


class Renderer:
    """Draws the ground and the pad through one camera."""

    def __init__(self, camera: PinholeCamera, pad: PrintOnGround, ground: Ground | None) -> None:
        """Take what there is to draw; without a ground, a plain one."""
        self._camera = camera
        self._pad = pad
        self._ground = ground
        self._grid = RayGrid(camera)

    @property
    def rays(self) -> Grid:
        """The camera's rays on the grid's nodes, (rows + 2, columns + 2, 3)."""
        return self._grid.rays

    @property
    def rows_px(self) -> NDArray[np.float64]:
        """Picture rows of the grid's nodes, (rows + 2,)."""
        return np.asarray(self._grid.rows_px, np.float64)

    def ground_nodes(self, viewpoint: Viewpoint) -> tuple[Grid, Grid]:
        """Where the rays of the grid meet the ground.

        Returns:
            Marker x, y in metres (rows + 2, columns + 2, 2), and the sine-like third coordinate (rows + 2, columns + 2), which is
            `_LOWEST_SINE` where a ray goes to the sky.
        """
        matrix = np.swapaxes(viewpoint.ground_from_ray, -1, -2).astype(np.float32)
        # One matrix, or one for each row of nodes where a shutter rolls. One is quicker on a flat list of rays.
        rays = self._grid.rays if matrix.ndim == 3 else self._grid.rays.reshape(-1, 3)
        hit = (rays @ matrix).reshape(self._grid.rays.shape)
        down = np.maximum(hit[..., 2], np.float32(_LOWEST_SINE))
        return np.asarray(hit[..., :2] / down[..., None], np.float32), down

    def render(self, viewpoint: Viewpoint) -> Scene:
        """Draw from one viewpoint, at one instant."""
        nodes_m, down = self.ground_nodes(viewpoint)
        if self._ground is None or self._board_fills(nodes_m):
            picture = np.full((self._camera.height_px, self._camera.width_px), MEAN_LEVEL, np.uint8)
        else:
            picture = self._draw_ground(self._ground, nodes_m, viewpoint.position_marker_m[2])
        blur_px2 = self._draw_pad(picture, viewpoint, nodes_m)
        if float(down.min()) <= _LOWEST_SINE:
            self._draw_sky(picture, down)
        return Scene(picture, blur_px2)

    def _board_fills(self, nodes_m: Grid) -> bool:
        """Whether nothing but the board is in view: the board is convex, so its being under all nodes is enough."""
        return float(np.abs(nodes_m).max()) < _SAFE_PART * self._pad.board_m / 2.0

    def _draw_ground(self, ground: Ground, nodes_m: Grid, height_m: float) -> Picture:
        fine, texel_m, period = ground.fine(height_m / self._camera.fx_px)
        texels = nodes_m / np.float32(texel_m)
        corner = np.array((texels[..., 0].min(), texels[..., 1].min()))
        texels -= (np.floor(corner / period) * period).astype(np.float32)
        size = (self._camera.height_px, self._camera.width_px)
        grains = np.empty((self._grid.rows * STEP_PX, self._grid.columns * STEP_PX), np.uint8)
        for first, last in _bands(self._grid.rows):
            band = _sampled(fine, enlarged(texels[first : last + 2]), cv2.BORDER_WRAP)
            grains[first * STEP_PX : last * STEP_PX] = band
        coarse_texels = nodes_m / np.float32(COARSE_TEXEL_M)
        fields = _sampled(ground.coarse, coarse_texels, cv2.BORDER_WRAP)
        large = cv2.resize(fields, None, fx=STEP_PX, fy=STEP_PX, interpolation=cv2.INTER_LINEAR)
        large = large[STEP_PX:-STEP_PX, STEP_PX:-STEP_PX]
        both = cv2.addWeighted(grains, 1.0, large, 1.0, -128.0)
        return np.asarray(both[: size[0], : size[1]], np.uint8)

    def _draw_pad(self, picture: Picture, viewpoint: Viewpoint, nodes_m: Grid) -> float:
        """Draw the board over the ground; gives the blur that came with it, the least where it differs."""
        box = self._box(self._pad.whole, viewpoint)
        if box is None:
            return PIXEL_VARIANCE_PX2
        first, *others = self._pad.sheets(_wanted_texel_m(self._pad.whole, box))
        blur_px2 = _draw_sheet(picture, first, box, nodes_m)
        for sheet in others:
            its_box = self._box(sheet, viewpoint)
            if its_box is not None:
                blur_px2 = min(blur_px2, _draw_sheet(picture, sheet, its_box, nodes_m))
        return blur_px2

    def _box(self, sheet: Sheet, viewpoint: Viewpoint) -> _Box | None:
        """The blocks of the grid that a sheet covers; None if it is out of view."""
        outline_m = sheet.outline_m
        points = np.concatenate([each.in_camera(outline_m) for each in viewpoint.extremes])
        before = points[:, 2] > _LOWEST_SINE
        if not before.any():
            return None
        side_px = self._camera.fx_px * sheet.side_m / max(float(np.median(points[:, 2])), _LOWEST_SINE)
        if not before.all():
            return _Box(0, 0, self._grid.columns, self._grid.rows, side_px)
        pixels = self._camera.project(points)
        low = np.floor((pixels.min(axis=0) - 2.0) / STEP_PX)
        high = np.ceil((pixels.max(axis=0) + 3.0) / STEP_PX)
        left, top = (max(int(v), 0) for v in low)
        right, bottom = min(int(high[0]), self._grid.columns), min(int(high[1]), self._grid.rows)
        if left >= right or top >= bottom:
            return None
        return _Box(left, top, right, bottom, side_px)

    def _draw_sky(self, picture: Picture, down: Grid) -> None:
        sky = enlarged(down)[: picture.shape[0], : picture.shape[1]] <= _LOWEST_SINE * 1.01
        picture[sky] = _SKY_LEVEL


def _wanted_texel_m(sheet: Sheet, box: _Box) -> float:
    return sheet.side_m / (box.side_px * _TEXELS_A_PIXEL)


def _draw_sheet(picture: Picture, sheet: Sheet, box: _Box, nodes_m: Grid) -> float:
    """Lay one sheet over the picture; gives the variance of its blur, pixels squared."""
    texture, texel_m = sheet.texture(_wanted_texel_m(sheet, box))
    nodes = sheet.texels(nodes_m[box.top : box.bottom + 2, box.left : box.right + 2], texel_m, texture.side_texels)
    place = picture[box.top * STEP_PX : box.bottom * STEP_PX, box.left * STEP_PX : box.right * STEP_PX]
    for first, last in _bands(box.bottom - box.top):
        behind, texels = place[first * STEP_PX : last * STEP_PX], enlarged(nodes[first : last + 2])
        levels = _cropped(_sampled(texture.levels, texels, cv2.BORDER_CONSTANT), behind)
        if texture.covers(nodes[first : last + 2]):
            behind[:] = levels
        else:
            _lay_over(behind, levels, _cropped(_sampled(texture.cover, texels, cv2.BORDER_CONSTANT), behind))
    texel_px = texel_m * box.side_px / sheet.side_m
    return texel_px**2 * (BLUR_TEXELS**2 + _TEXEL_VARIANCE)


def _bands(rows: int) -> list[tuple[int, int]]:
    """The grid's rows in bands that are small enough for their maps to stay in the cache."""
    return [(first, min(first + _BAND_ROWS, rows)) for first in range(0, rows, _BAND_ROWS)]


def _lay_over(behind: Picture, levels: Picture, cover: Picture) -> None:
    """Put the board, brightness and cover, over a part of the picture."""
    cv2.add(cv2.multiply(behind, cv2.bitwise_not(cover), scale=1.0 / 255.0), levels, dst=behind)


def _cropped(picture: Picture, behind: Picture) -> Picture:
    return picture[: behind.shape[0], : behind.shape[1]]


def _sampled(texture: Picture, texels: Grid, border: int) -> Picture:
    """The texture at the places that a map (rows, columns, 2) of texel coordinates names; no second map is needed."""
    return np.asarray(
        cv2.remap(texture, texels, np.empty(0, np.float32), cv2.INTER_LINEAR, borderMode=border), np.uint8
    )
