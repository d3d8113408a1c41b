"""Laying the rendered pattern over the picture: a Gauss-Newton fit of pose, blur and light to the pixels themselves."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from services.detector.aided import texture
from services.detector.aided.fit_model import POSE, FitModel, PrintScale, fit_model
from services.detector.aided.guess import BLUR_PX, Guess
from services.detector.aided.light import GROUND_LEVEL, is_plausible, light_at, light_prior, likeliest_edge
from services.detector.aided.marker_view import MarkerView, TiltPrior
from services.detector.aided.patch import Patch, patch_around
from services.detector.aided.pattern import Pattern
from services.detector.aided.pixel_rays import PixelRays
from services.detector.aided.print_plane import cells_from_rays
from services.detector.aided.texture import PatternTexture
from services.detector.detector import GreyPicture

Array = NDArray[np.float64]

_LEAST_NOISE = 1.5
_BLUR_LOG_SIGMA = 0.4
_SLANT_SIGMA_PX2 = 0.35
_LARGEST_BLUR_PX = 1.9
_LARGEST_TURN_RAD = 0.35
_LARGEST_SHIFT_CELLS = 1.0
_LARGEST_APPROACH = 0.15
_CONVERGED_CELLS = 8e-3
_ABOUT_CELLS = 0.05
_COARSE_LOG_STEP = 2.0**-2
_STAYED_CELLS = 0.3
"""A smaller step leaves the same pixels in view."""
_ENOUGH_FOR_SHADOW = 120
_INK, _PAPER = 28.0, 218.0
_EDGE_ANGLE_SIGMA, _EDGE_OFFSET_SIGMA, _EDGE_LOG_SIGMA = 0.3, 1.0, 0.5
_BLUR_WEIGHTS = np.array((_BLUR_LOG_SIGMA, _BLUR_LOG_SIGMA, _SLANT_SIGMA_PX2)) ** -2.0
_EDGE_WEIGHTS = np.array((_EDGE_ANGLE_SIGMA, _EDGE_OFFSET_SIGMA, _EDGE_LOG_SIGMA)) ** -2.0
_NO_TURN, _UNIT = np.zeros(3), np.eye(3)
_HANG_TOGETHER, _SHADOW_SOFT, _SHRUNK = 1.24, 1.73, 1.25
"""How much larger the corners' variances are than if pixels erred each on its own, and how much more so with a shadow's edge, or, in even light, in a picture that was
made smaller. What the model misses, the shape of motion blur, grain beside the board, how soft a shadow is, is alike in neighbouring pixels, and more of what is left
once noise has been averaged. From 570 rendered pads from 3.5 m to 36 m, a quarter of them with an edge."""
_FEW_OF_MANY, _FEW_FROM_SHRINK = 6.0, 8
"""The same in a picture of which so many pixels became one: of 300 pads half out of the picture, from 0.45 m to 0.9 m, fitted to half as many pixels as now: today's
fits err by 0.5 to 0.9 of that, by 1.5 of it where all four corners are out. The edges of a pad that is whole in view are
followed instead, see `backend`."""


@dataclass(frozen=True)
class Attempt:
    """A fit that is about right, and what it promises."""

    guess: Guess
    """Pose, blur and light."""
    residual: float
    """Root mean square difference between model and picture, grey levels."""
    unexplained_without_code: float
    """What would remain if the board were blank, grey levels."""
    patch: Patch
    """What was compared."""

    def code_likeness(self, noise: float = 0.0) -> float:
        """As of an alignment."""
        return _code_likeness(self.residual, self.unexplained_without_code, noise)


@dataclass(frozen=True)
class Alignment:
    """A fit of one marker."""

    guess: Guess
    """Pose, blur and light."""
    corners_px: Array
    """(4, 2), in the order of `Marker.corners_px`."""
    corner_covariance_px2: Array
    """(8, 8), of x, y of the four corners."""
    likeness: float
    """Correlation of the model with the picture, 0 to 1."""
    unexplained_without_code: float
    """Root mean square difference that would remain if the board were blank, grey levels."""
    plausible: bool
    """Whether the brightnesses and the blur are such as can be."""
    light: Array
    """Brightness of ink, board and ground, then two slopes of the board's in even light, grey levels."""
    residual: float
    """Root mean square difference between model and picture, grey levels."""
    side_px: float
    """Mean length of the sides, pixels of the whole picture."""
    patch: Patch
    """What was compared."""
    differences: Array
    """(N,): picture minus model, grey levels."""

    @property
    def view(self) -> MarkerView:
        """The pose."""
        return self.guess.view

    @property
    def corner_sigma_px(self) -> float:
        """Standard deviation of a corner's coordinate, root mean square over all, pixels."""
        return math.sqrt(float(np.trace(self.corner_covariance_px2)) / 8.0)

    def code_likeness(self, noise: float = 0.0) -> float:
        """Correlation of the code alone with what light and ground leave unexplained, the picture's noise taken out, 0 to 1."""
        return _code_likeness(self.residual, self.unexplained_without_code, noise)


@dataclass(frozen=True)
class _Step:
    guess: Guess
    moved_cells: float
    information: Array
    """(m, m), of all unknowns."""
    model: FitModel


class Aligner:
    """Fits one marker to pictures of one camera."""

    def __init__(self, pattern: Pattern, side_m: float, rays: PixelRays) -> None:
        self.pattern = pattern
        self.side_m = side_m
        self._texture, self._coarse = PatternTexture(pattern), PatternTexture(pattern, _COARSE_LOG_STEP)
        self._rays = rays
        self._half = pattern.count / 2.0
        self.cell_m = side_m / pattern.count
        half = side_m / 2.0
        self._corners_m = np.array([[-half, half, 0.0], [half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0]])
        self._matrix, self._distortion = rays.camera.matrix, rays.camera.distortion
        n = float(pattern.count)
        self._probes = np.array(((0.0, 0.0, 1.0), (n, 0.0, 1.0), (n, n, 1.0), (0.0, n, 1.0), (n / 2, n / 2, 1.0))).T

    @property
    def camera(self) -> PinholeCamera:
        """The camera of the pictures."""
        return self._rays.camera

    @property
    def rays(self) -> PixelRays:
        """Its pixels' rays."""
        return self._rays

    def corners_px(self, view: MarkerView) -> Array:
        """Where the corners appear, (4, 2); NaN if they are not all before the camera."""
        at = self._corners_m @ view.R.T + view.t
        if not at[:, 2].min() > 0.0:
            return np.full((4, 2), math.nan)
        seen = cv2.projectPoints(at, _NO_TURN, _NO_TURN, self._matrix, self._distortion)[0]
        return np.asarray(seen, np.float64).reshape(4, 2)

    def fitted(self, picture: GreyPicture, begin: Guess, tilt: TiltPrior, steps: int) -> Alignment | None:
        """Improve a pose that is wrong by less than a cell or so.

        Args:
            picture: (height, width), grey levels.
            begin: Where to begin.
            tilt: Which way the print should face.
            steps: How many steps at most.

        Returns:
            None if the marker is not in view or the fit runs away.
        """
        fit = self._run(picture, begin, tilt, steps)
        return None if fit is None else self._finished(*fit)

    def improved(self, picture: GreyPicture, begin: Guess, tilt: TiltPrior, steps: int) -> Guess | None:
        """The same, but only about right, and without an account of it."""
        fit = self._run(picture, begin, tilt, steps, roughly=True)
        return None if fit is None else fit[1].guess

    def attempted(
        self, picture: GreyPicture, begin: Guess, tilt: TiltPrior, least: tuple[float, ...]
    ) -> Attempt | None:
        """The same from where the marker may not be at all.

        Args:
            picture: (height, width), grey levels.
            begin: Where to begin.
            tilt: Which way the print should face.
            least: How like the code the picture must be at the beginning, after the first step, ...: less is not worth going on. There are
                as many steps at most.

        Returns:
            None if the marker is not in view, the fit runs away or is given up.
        """
        fit = self._run(picture, begin, tilt, len(least), least, roughly=True)
        if fit is None:
            return None
        patch, step = fit
        count = len(patch.brightness)
        residual, blank = (math.sqrt(value / count) for value in (step.model.residual2, step.model.blank_residual2))
        return Attempt(step.guess, residual, blank, patch)

    def _run(
        self,
        picture: GreyPicture,
        begin: Guess,
        tilt: TiltPrior,
        steps: int,
        least: tuple[float, ...] = (),
        *,
        roughly: bool = False,
    ) -> tuple[Patch, _Step] | None:
        patch = self._patch(picture, begin.view)
        guess, step = begin, None
        for count in range(steps):
            if patch is None:
                return None
            # Before the blur is known it would be drawn anew with each step.
            drawn = self._coarse if roughly or count == 0 else self._texture
            step = self._step(patch, guess, tilt, drawn)
            if step is None or (count < len(least) and step.model.code_likeness < least[count]):
                return None
            guess = step.guess
            if step.moved_cells < (_ABOUT_CELLS if roughly else _CONVERGED_CELLS) and (roughly or count > 0):
                break
            if count == 2 and count + 1 < steps and step.moved_cells > _STAYED_CELLS:
                patch = self._patch(picture, guess.view)
        return None if step is None or patch is None else (patch, step)

    def shaded(self, attempt: Attempt) -> Guess | None:
        """The same guess with the shadow's edge that explains the picture best; None if none explains it much better."""
        patch, guess = attempt.patch, attempt.guess
        few = slice(None, None, math.ceil(len(patch.brightness) / _ENOUGH_FOR_SHADOW))
        u, v, _ = self.places(patch.rays[:, few], guess.view)
        s_u, s_v, _ = self._scale(guess.view).blur_cells(guess, patch.shrink)
        shades = self._texture.shades(u, v, s_u, s_v)
        white, board, brightness = shades[texture.WHITE], shades[texture.BOARD], patch.brightness[few]
        edge = likeliest_edge(white, board, u, v, self._half, (s_u + s_v) / 2.0, brightness)
        return Guess(guess.view, guess.blur, edge) if edge is not None else None

    def rendered(self, guess: Guess, left: int, top: int, columns: int, rows: int, shrink: int) -> GreyPicture | None:
        """The marker as it should look in a part of the picture, (rows, columns), made smaller by a power of two.

        Returns:
            None if the part reaches out of the picture.
        """
        rays = self._rays.block(left, top, columns, rows, shrink)
        if rays.shape[1] != rows * columns:
            return None
        u, v, _ = self.places(rays, guess.view)
        s_u, s_v, _ = self._scale(guess.view).blur_cells(guess, shrink)
        shades = self._texture.shades(u, v, s_u, s_v)
        white, board = shades[texture.WHITE], shades[texture.BOARD]
        level = _INK * (board - white) + _PAPER * white + GROUND_LEVEL * (1.0 - board)
        return np.asarray(np.clip(level, 0.0, 255.0).reshape(rows, columns), np.uint8)

    def places(self, rays: Array, view: MarkerView) -> tuple[Array, Array, Array]:
        """Where rays (3, N) meet the print: u and v in cells, and a number that is positive before the camera, each (N,)."""
        u, v, scale = cells_from_rays(view, self.side_m, self.pattern.count) @ rays
        return u / scale, v / scale, scale

    def cell_shares(self, alignment: Alignment) -> Array:
        """How much each cell of the quiet zone and the marker contributes to each pixel, (N, (n + 2)^2)."""
        patch, guess = alignment.patch, alignment.guess
        u, v, _ = self.places(patch.rays, guess.view)
        s_u, s_v, _ = self._scale(guess.view).blur_cells(guess, patch.shrink)
        return self.pattern.cell_shares(u, v, s_u, s_v)

    def contrast(self, alignment: Alignment) -> Array:
        """White minus black at each pixel, (N,), grey levels."""
        edge, patch = alignment.guess.edge, alignment.patch
        step = np.full(len(patch.brightness), float(alignment.light[1] - alignment.light[0]))
        if edge is None:
            return step
        u, v, _ = self.places(patch.rays, alignment.view)
        s_u, s_v, _ = self._scale(alignment.view).blur_cells(alignment.guess, patch.shrink)
        return step * light_at(u, v, self._half, edge, (s_u + s_v) / 2.0)

    def _patch(self, picture: GreyPicture, view: MarkerView) -> Patch | None:
        plane = cells_from_rays(view, self.side_m, self.pattern.count)
        return patch_around(picture, self._rays, self.corners_px(view), plane, self.pattern.count)

    def _scale(self, view: MarkerView) -> PrintScale:
        camera, (x, y, z) = self._rays.camera, view.t.tolist()
        (r11, r12, _), (r21, r22, _), (r31, r32, _) = view.R.tolist()
        a, b = camera.fx_px * self.cell_m / z, camera.fy_px * self.cell_m / z
        return PrintScale(
            max(math.hypot(a * (r11 - x / z * r31), b * (r21 - y / z * r31)), 1e-3),
            max(math.hypot(a * (r12 - x / z * r32), b * (r22 - y / z * r32)), 1e-3),
        )

    def _step(self, patch: Patch, guess: Guess, tilt: TiltPrior, drawn: PatternTexture) -> _Step | None:
        model = fit_model(drawn, patch, guess, self.side_m, self.pattern.count, self._scale(guess.view))
        freedom = max(len(model.residual) - len(model.gradient), 8)
        noise2 = max(model.residual2 / freedom, _LEAST_NOISE**2)
        M, g = model.normal / noise2, model.gradient / noise2
        _add_priors(M, g, guess, tilt, model.factors)
        solved, found = cv2.solve(M, g, flags=cv2.DECOMP_CHOLESKY)
        delta = np.asarray(found, np.float64).ravel()
        if not solved or not math.isfinite(float(delta.sum())):
            return None
        step = delta * self._allowed(delta, guess.view)
        moved = guess.moved(step)
        if not moved.view.t[2] > 0.0:
            return None
        A = (model.motions @ step[POSE]).reshape(3, 3) @ self._probes
        shift = A[:2] - self._probes[:2] * A[2]
        return _Step(moved, math.sqrt(float((shift * shift).sum()) / shift.shape[1]), M, model)

    def _allowed(self, delta: Array, view: MarkerView) -> float:
        """Which part of a step does not leave the region where the model is about linear."""
        x, y, approach, *turns = np.abs(delta[POSE]).tolist()
        shift_cells: float = max(x, y) * float(view.t[2]) / self.cell_m
        excess: float = max(
            shift_cells / _LARGEST_SHIFT_CELLS, max(turns) / _LARGEST_TURN_RAD, approach / _LARGEST_APPROACH
        )
        return 1.0 / max(excess, 1.0)

    def _finished(self, patch: Patch, fit: _Step) -> Alignment:
        corners = self.corners_px(fit.guess.view)
        slopes = self._corner_slopes(fit.guess.view)
        side_px = float(np.hypot(*(corners - corners[[3, 0, 1, 2]]).T).sum()) / 4.0
        count, residual2 = len(patch.brightness), fit.model.residual2
        remaining = residual2 - float(fit.model.residual.sum()) ** 2 / count
        total = float(patch.brightness @ patch.brightness) - float(patch.brightness.sum()) ** 2 / count
        covariance = np.linalg.inv(fit.information)[POSE, POSE]
        return Alignment(
            guess=fit.guess,
            corners_px=corners,
            corner_covariance_px2=slopes @ covariance @ slopes.T * _excess(fit.guess, patch.shrink),
            likeness=math.sqrt(max(1.0 - remaining / max(total, 1e-9), 0.0)),
            unexplained_without_code=math.sqrt(fit.model.blank_residual2 / count),
            plausible=_is_plausible(fit),
            light=fit.model.factors,
            residual=math.sqrt(residual2 / count),
            side_px=side_px,
            patch=patch,
            differences=fit.model.residual,
        )

    def _corner_slopes(self, view: MarkerView) -> Array:
        """Derivatives (8, 6) of the corners' pixels by (shift as a part of the distance, turn); the lens's stretching left out."""
        camera, rows, d = self._rays.camera, [], float(view.t[2])
        arms = self._corners_m @ view.R.T
        for (mx, my, mz), (x, y, z) in zip(arms.tolist(), (arms + view.t).tolist(), strict=True):
            a, b = camera.fx_px / z, camera.fy_px / z
            rows.append([a * d, 0.0, -a * d * x / z, -a * x / z * my, a * (mz + x / z * mx), -a * my])
            rows.append([0.0, b * d, -b * d * y / z, -b * (mz + y / z * my), b * y / z * mx, b * mx])
        return np.array(rows)


def _code_likeness(residual: float, unexplained_without_code: float, noise: float) -> float:
    misfit2 = max(residual**2 - noise**2, 0.0)
    return math.sqrt(max(1.0 - misfit2 / max(unexplained_without_code**2, 1e-9), 0.0))


def _excess(guess: Guess, shrink: int) -> float:
    if shrink >= _FEW_FROM_SHRINK:
        return _HANG_TOGETHER * _SHRUNK * _FEW_OF_MANY
    if guess.edge is not None:
        return _HANG_TOGETHER * _SHADOW_SOFT
    return _HANG_TOGETHER * (_SHRUNK if shrink > 1 else 1.0)


def _is_plausible(fit: _Step) -> bool:
    blur = fit.guess.blur
    return max(blur.u_px, blur.v_px) < _LARGEST_BLUR_PX and is_plausible(fit.model.factors, fit.guess.edge)


def _add_priors(M: Array, g: Array, guess: Guess, tilt: TiltPrior, factors: Array) -> None:
    n, wanted = guess.view.R[:, 2], tilt.normal_camera
    # How the cross product of the normal and the wanted one changes with a small turn.
    change = np.outer(n, wanted) - float(n @ wanted) * _UNIT
    M[3:6, 3:6] += change.T @ change / tilt.sigma_rad**2
    g[3:6] -= change.T @ _cross(n, wanted) / tilt.sigma_rad**2
    blur, light, means = guess.blur, *light_prior(len(factors))
    edge = _EDGE_WEIGHTS if guess.edge is not None else ()
    weights = np.concatenate((_BLUR_WEIGHTS, light, edge))
    excess = np.zeros(len(weights))
    excess[:3] = math.log(blur.u_px / BLUR_PX), math.log(blur.v_px / BLUR_PX), blur.uv_px2
    excess[3 : 3 + len(factors)] = factors - means
    np.einsum("ii->i", M)[6:] += weights
    g[6:] -= weights * excess


def _cross(a: Array, b: Array) -> Array:
    """The vector product; NumPy's own takes ten times as long for two vectors."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))
