"""A camera that does not exist: pictures from the ground truth, with every error of the installation in them."""

import dataclasses
import math
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from alight.geometry.rolling_shutter import row_after_s
from alight.geometry.rotation import Matrix
from alight.markers.layout import InkSquare, PlacedMarker, layout_from
from alight.runtime.seed import generator
from schemas.calibration import CameraCalibration
from schemas.settings import Settings
from schemas.settings.camera import Board
from schemas.settings.pad import PadSettings
from schemas.truth import GroundTruth
from services.camera.ground import Ground
from services.camera.pad_print import PadPrint
from services.camera.print_on_ground import PrintOnGround
from services.camera.renderer import Renderer, Scene
from services.camera.sensor import Sensor
from services.camera.sunshine import with_glare, with_shadow
from services.camera.viewpoint import RollingViewpoint, Viewpoint, mount_rotation

Picture = NDArray[np.uint8]

_NO_SMEAR_PX = 0.5
"""Less smear than this widens the blur of the default lens by less than 3 %."""
_SMEAR_AN_EXPOSURE_PX = 1.5
"""Points this far apart make one line when the default lens has blurred them."""
_MOST_EXPOSURES = 3
_NEAREST_M = 0.1
"""The camera does not come nearer to the pad than this: the legs are longer."""


class SimulatedCamera:
    """Renders and exposes. The same seed and the same truths in the same order give the same pixels."""

    def __init__(self, settings: Settings, calibration: CameraCalibration, lying: PrintOnGround | None = None) -> None:
        """Build camera, pad and ground.

        Args:
            settings: Sections `pad`, `camera.simulated`, `simulator.installation`, and the seed.
            calibration: The camera as believed; the true one has `installation.lens_scale` times its focal length.
            lying: What lies on the ground instead of the pad.

        Raises:
            LayoutError: If the pad's layout cannot be had.
            FamilyError: If the pad's marker does not exist.
        """
        simulated, installation = settings.camera.simulated, settings.simulator.installation
        self._camera = true_camera(calibration, installation.lens_scale)
        self._mount = mount_rotation(installation)
        self._sunlight, self._optics = simulated.sunlight, simulated.optics
        self._pad: PrintOnGround = _pad(settings) if lying is None else lying
        textured = simulated.ground == "textured"
        ground = Ground(generator(settings.seed, "camera.ground")) if textured else None
        self._renderer = Renderer(self._camera, self._pad, ground)
        self._sensor = Sensor(self._camera, self._optics, generator(settings.seed, "camera.noise"))

    def draw_all(self) -> None:
        """Draw the print in every size now, so that no frame has to wait for it."""
        self._pad.draw_all(_NEAREST_M / self._camera.fx_px)

    def capture(self, truth: GroundTruth) -> Picture:
        """The picture whose exposure, of its middle row, has its middle at the time of the truth, (height, width), grey levels."""
        instants_s = exposure_instants_s(truth, self._mount, self._camera.fx_px, self._optics.exposure_s)
        scenes = [self._lit_scene(truth, after_s) for after_s in instants_s]
        blur_px2 = scenes[len(scenes) // 2].blur_px2
        return self._sensor.expose(_mean([scene.picture for scene in scenes]), blur_px2)

    def _viewpoint(self, truth: GroundTruth, after_s: float) -> Viewpoint:
        if self._optics.row_time_s == 0.0:
            return Viewpoint.from_truth(truth, self._mount, after_s)
        height_px, row_time_s = self._camera.height_px, self._optics.row_time_s
        rows_after_s = [row_after_s(row, height_px, row_time_s) for row in self._renderer.rows_px.tolist()]
        return RollingViewpoint.of_rows(truth, self._mount, rows_after_s, after_s)

    def _lit_scene(self, truth: GroundTruth, after_s: float) -> Scene:
        viewpoint = self._viewpoint(truth, after_s)
        scene = self._renderer.render(viewpoint)
        if self._sunlight.shadow_depth <= 0.0 and self._sunlight.glare_level <= 0.0:
            return scene
        ground_m, _ = self._renderer.ground_nodes(viewpoint)
        picture = with_shadow(scene.picture, ground_m, truth.pad_azimuth_rad, self._sunlight)
        picture = with_glare(picture, self._renderer.rays, viewpoint, truth.pad_azimuth_rad, self._sunlight)
        return Scene(picture, scene.blur_px2)


def _pad(settings: Settings) -> PadPrint:
    board = settings.camera.simulated.board
    pad_scale = settings.simulator.installation.pad_scale
    markers, board_m = printed(settings.pad, board, pad_scale)
    ink = tuple(
        InkSquare(square.side_m * pad_scale, square.x_m * pad_scale, square.y_m * pad_scale)
        for square in layout_from(settings.pad).ink
    )
    return _pad_print(markers, board_m, board.black_level, board.white_level, ink)


def printed(pad: PadSettings, board: Board, pad_scale: float) -> tuple[tuple[PlacedMarker, ...], float]:
    """The markers as they are printed, and the edge of their board, metres.

    Args:
        pad: What should be printed.
        board: How wide the board is around a single marker; a layout says it itself.
        pad_scale: How much larger the print came out.
    """
    layout = layout_from(pad)
    markers = tuple(
        dataclasses.replace(
            marker, side_m=marker.side_m * pad_scale, x_m=marker.x_m * pad_scale, y_m=marker.y_m * pad_scale
        )
        for marker in layout.markers
    )
    if pad.layout:
        return markers, layout.board_m * pad_scale
    side_m = markers[0].side_m
    return markers, side_m * (1.0 + 2.0 * board.margin)


@lru_cache(maxsize=4)
def _pad_print(
    markers: tuple[PlacedMarker, ...],
    board_m: float,
    black_level: float,
    white_level: float,
    ink: tuple[InkSquare, ...],
) -> PadPrint:
    """The print. Its textures take longer than a hundred frames, and flight after flight of a campaign has the same."""
    return PadPrint(markers, board_m=board_m, black_level=black_level, white_level=white_level, ink=ink)


def true_camera(calibration: CameraCalibration, lens_scale: float) -> PinholeCamera:
    """The lens as it is: the calibrated one with another focal length."""
    believed = PinholeCamera.from_calibration(calibration)
    return dataclasses.replace(believed, fx_px=believed.fx_px * lens_scale, fy_px=believed.fy_px * lens_scale)


def exposure_instants_s(truth: GroundTruth, mount: Matrix, focal_px: float, exposure_s: float) -> list[float]:
    """At which moments of the exposure to draw, seconds from its middle: one if nothing moves visibly, more for more motion."""
    begin = Viewpoint.from_truth(truth, mount, -exposure_s / 2.0)
    end = Viewpoint.from_truth(truth, mount, exposure_s / 2.0)
    rays = np.array([(x, y, 1.0) for x in (-0.6, 0.0, 0.6) for y in (-0.6, 0.0, 0.6)])
    ground = rays @ begin.ground_from_ray.T
    ground = ground[ground[:, 2] > 0.05]
    if len(ground) == 0:
        return [0.0]
    before = ground @ np.linalg.inv(begin.ground_from_ray).T
    after = ground @ np.linalg.inv(end.ground_from_ray).T
    moved = before[:, :2] / before[:, 2:] - after[:, :2] / after[:, 2:]
    smear_px = focal_px * float(np.mean(np.hypot(moved[:, 0], moved[:, 1])))
    if not smear_px > _NO_SMEAR_PX:
        return [0.0]
    count = min(1 + math.ceil(smear_px / _SMEAR_AN_EXPOSURE_PX), _MOST_EXPOSURES)
    return [exposure_s * ((index + 0.5) / count - 0.5) for index in range(count)]


def _mean(pictures: list[Picture]) -> Picture:
    if len(pictures) == 1:
        return pictures[0]
    total = np.zeros(pictures[0].shape, np.float32)
    for picture in pictures:
        cv2.accumulate(picture, total)
    return np.rint(total / len(pictures)).astype(np.uint8)
