"""Laying the rendered pattern over the picture: a Gauss-Newton fit of pose, blur and light to the pixels themselves."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from alight.geometry.camera import PinholeCamera
from services.detector.aided.light import Lit, ShadowEdge, is_plausible, light_at, likeliest_edge, lit
from services.detector.aided.marker_view import MarkerView, TiltPrior
from services.detector.aided.one_thread import gram
from services.detector.aided.pattern import Pattern, Shades
from services.detector.aided.pixel_rays import PixelRays
from services.detector.detector import GreyPicture

Array = NDArray[np.float64]

_LARGEST_SIDE_PX = 28.0
_QUIET_CELLS = 1.0
_FEWEST_PIXELS, _MOST_PIXELS = 40, 700
"""Of more pixels, every second, third, ... is taken."""
_LEAST_NOISE = 1.5
_BLUR_PX = 0.8
_BLUR_LOG_SIGMA = 0.4
_SLANT_SIGMA_PX2 = 0.35
_LEAST_BLUR_PX = 0.35
_LARGEST_BLUR_PX = 1.9
_LARGEST_TURN_RAD = 0.35
_LARGEST_SHIFT_CELLS = 1.0
_LARGEST_APPROACH = 0.15
_LARGEST_BLUR_STEP = 0.3
_CONVERGED_CELLS = 8e-3
_ABOUT_CELLS = 0.05
_STAYED_CELLS = 0.3
"""A smaller step leaves the same pixels in view."""
_GROUND_LEVEL, _GROUND_SIGMA = 128.0, 100.0
_INK, _PAPER = 28.0, 218.0
_SLOPE_SIGMA = 20.0
_EDGE_ANGLE_SIGMA, _EDGE_OFFSET_SIGMA, _EDGE_LOG_SIGMA = 0.3, 1.0, 0.5
_LARGEST_EDGE_STEP = np.array((0.2, 0.6, 0.3))
_BLURS = slice(6, 9)
_MODEL_SIGMA_SIDES = 5.7e-4
"""What the model misses (the shape of motion blur, soft shadows, grain beside the board), as an error of a corner's coordinate in parts of the side. With
it the variance that is told is that of the errors of 191 rendered pads from 4 m to 36 m, in the mean of all."""


@dataclass(frozen=True)
class Blur:
    """Of lens, pixel and motion: standard deviations along the marker's axes, and the moment between them, pixels of the whole picture."""

    u_px: float = _BLUR_PX
    v_px: float = _BLUR_PX
    uv_px2: float = 0.0


@dataclass(frozen=True)
class Patch:
    """The pixels around a marker, perhaps of a picture made smaller."""

    brightness: Array
    """(N,), grey levels."""
    rays: Array
    """(N, 2), x/z and y/z."""
    shrink: int


@dataclass(frozen=True)
class Guess:
    """Where a fit begins, and where it has come to."""

    view: MarkerView
    blur: Blur = Blur()
    edge: ShadowEdge | None = None


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
    """Brightness of ink, board and ground, then two slopes of the board's, or the three once more in the shadow, grey levels."""
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

    def code_likeness(self, noise: float = 0.0) -> float:
        """Correlation of the code alone with what light and ground leave unexplained, the picture's noise taken out, 0 to 1."""
        misfit2 = max(self.residual**2 - noise**2, 0.0)
        return math.sqrt(max(1.0 - misfit2 / max(self.unexplained_without_code**2, 1e-9), 0.0))


@dataclass(frozen=True)
class _Model:
    """The picture as the guess has it, and how it would change."""

    u: Array
    v: Array
    du: Array
    dv: Array
    shades: Shades
    light: Lit
    factors: Array
    brightness: Array
    residual: Array
    jacobian: Array


@dataclass(frozen=True)
class _Step:
    guess: Guess
    moved_cells: float
    covariance: Array
    model: _Model


class Aligner:
    """Fits one marker to pictures of one camera."""

    def __init__(self, pattern: Pattern, side_m: float, rays: PixelRays) -> None:
        self.pattern = pattern
        self.side_m = side_m
        self._rays = rays
        self._half = pattern.count / 2.0
        self.cell_m = side_m / pattern.count
        half = side_m / 2.0
        self._corners_m = np.array([[-half, half, 0.0], [half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0]])

    @property
    def camera(self) -> PinholeCamera:
        """The camera of the pictures."""
        return self._rays.camera

    def corners_px(self, view: MarkerView) -> Array:
        """Where the corners appear, (4, 2)."""
        return self._rays.camera.project(self._corners_m @ view.R.T + view.t)

    def fitted(self, picture: GreyPicture, begin: Guess, tilt: TiltPrior, steps: int) -> Alignment | None:
        """Improve a pose that is wrong by less than a cell or so.

        Returns:
            None if the marker is not in view or the fit runs away.
        """
        fit = self._run(picture, begin, tilt, steps, _CONVERGED_CELLS)
        return None if fit is None else self._finished(*fit)

    def improved(self, picture: GreyPicture, begin: Guess, tilt: TiltPrior, steps: int) -> Guess | None:
        """The same, but only about right, and without an account of it."""
        fit = self._run(picture, begin, tilt, steps, _ABOUT_CELLS)
        return None if fit is None else fit[1].guess

    def _run(
        self, picture: GreyPicture, begin: Guess, tilt: TiltPrior, steps: int, enough_cells: float
    ) -> tuple[Patch, _Step] | None:
        patch = self._patch(picture, begin.view)
        guess, step = begin, None
        for count in range(steps):
            if patch is None:
                return None
            step = self._step(patch, guess, tilt)
            if step is None:
                return None
            guess = step.guess
            if step.moved_cells < enough_cells:
                break
            if count == 2 and count + 1 < steps and step.moved_cells > _STAYED_CELLS:
                patch = self._patch(picture, guess.view)
        return None if step is None or patch is None else (patch, step)

    def shaded(self, alignment: Alignment) -> Guess:
        """The same guess with the shadow's edge that explains the picture best."""
        patch, guess = alignment.patch, alignment.guess
        u, v, _ = self.places(patch.rays, guess.view)
        s_u, s_v, _ = self._blur_cells(guess, patch.shrink)
        shades = self.pattern.shades(u, v, s_u, s_v)
        edge = likeliest_edge(shades, u, v, self._half, (s_u + s_v) / 2.0, patch.brightness)
        return Guess(guess.view, guess.blur, edge)

    def rendered(self, guess: Guess, left: int, top: int, columns: int, rows: int, shrink: int) -> GreyPicture | None:
        """The marker as it should look in a part of the picture, (rows, columns), made smaller by a whole number.

        Returns:
            None if the part reaches out of the picture.
        """
        rays = self._rays.block(left, top, columns, rows, shrink).reshape(-1, 2)
        if len(rays) != rows * columns:
            return None
        u, v, _ = self.places(rays, guess.view)
        s_u, s_v, _ = self._blur_cells(guess, shrink)
        shades = self.pattern.shades(u, v, s_u, s_v)
        level = _INK * (shades.board - shades.white) + _PAPER * shades.white + _GROUND_LEVEL * (1.0 - shades.board)
        return np.clip(level, 0.0, 255.0).reshape(rows, columns).astype(np.uint8)

    def places(self, rays: Array, view: MarkerView) -> tuple[Array, Array, Array]:
        """Where rays (N, 2) meet the print: u and v in cells, and a number that is positive before the camera, each (N,)."""
        G = np.linalg.inv(np.column_stack((view.R[:, 0], view.R[:, 1], view.t)))
        hit = rays @ G[:, :2].T + G[:, 2]
        scale = 1.0 / (hit[:, 2] * self.cell_m)
        return hit[:, 0] * scale + self._half, self._half - hit[:, 1] * scale, hit[:, 2]

    def cell_shares(self, alignment: Alignment) -> Array:
        """How much each cell of the quiet zone and the marker contributes to each pixel, (N, (n + 2)^2)."""
        patch, guess = alignment.patch, alignment.guess
        u, v, _ = self.places(patch.rays, guess.view)
        s_u, s_v, _ = self._blur_cells(guess, patch.shrink)
        return self.pattern.cell_shares(u, v, s_u, s_v)

    def contrast(self, alignment: Alignment) -> Array:
        """White minus black at each pixel, (N,), grey levels."""
        patch, guess = alignment.patch, alignment.guess
        step = np.full(len(patch.brightness), float(alignment.light[1] - alignment.light[0]))
        if guess.edge is None:
            return step
        u, v, _ = self.places(patch.rays, guess.view)
        s_u, s_v, _ = self._blur_cells(guess, patch.shrink)
        return step * light_at(u, v, self._half, guess.edge, (s_u + s_v) / 2.0)

    def _patch(self, picture: GreyPicture, view: MarkerView) -> Patch | None:
        corners = self.corners_px(view)
        if not np.isfinite(corners).all():
            return None
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
        shrink = max(int(float(sides.mean()) / _LARGEST_SIDE_PX), 1)
        reach = float(sides.max()) * (_QUIET_CELLS / self.pattern.count) * 1.5
        left, top = np.floor(corners.min(axis=0) - reach).tolist()
        right, bottom = np.ceil(corners.max(axis=0) + reach + 1.0).tolist()
        height, width = picture.shape
        left, top = int(max(left, 0)), int(max(top, 0))
        columns, rows = int(min(right, width) - left) // shrink, int(min(bottom, height) - top) // shrink
        if columns < 4 or rows < 4:
            return None
        part = picture[top : top + rows * shrink, left : left + columns * shrink]
        if shrink > 1:
            part = np.asarray(cv2.resize(part, (columns, rows), interpolation=cv2.INTER_AREA), np.uint8)
        rays = self._rays.block(left, top, columns, rows, shrink).reshape(-1, 2)
        u, v, before = self.places(rays, view)
        low, high = -_QUIET_CELLS, self.pattern.count + _QUIET_CELLS
        inside = np.flatnonzero((u > low) & (u < high) & (v > low) & (v < high) & (before > 0.0))
        if len(inside) < _FEWEST_PIXELS:
            return None
        used = inside[:: math.ceil(len(inside) / _MOST_PIXELS)]
        return Patch(part.reshape(-1)[used].astype(np.float64), rays[used], shrink)

    def _slopes(self, rays: Array, view: MarkerView, u: Array, v: Array) -> tuple[Array, Array]:
        """Derivatives (N, 6) of u and v by (shift as a part of the distance, turn) of the marker in the camera frame."""
        r1, r2, _ = view.R.T
        m = ((u - self._half) * self.cell_m)[:, None] * r1 + ((self._half - v) * self.cell_m)[:, None] * r2
        x, y = rays.T
        a11, a12 = r1[0] - x * r1[2], r2[0] - x * r2[2]
        a21, a22 = r1[1] - y * r1[2], r2[1] - y * r2[2]
        scale = 1.0 / (self.cell_m * (a11 * a22 - a12 * a21))
        z, zeros = float(view.t[2]), np.zeros_like(x)
        full = zeros + z
        # How x and y of each point in the picture, times its depth, move with the six parameters.
        along_x = np.column_stack((full, zeros, -x * z, -x * m[:, 1], m[:, 2] + x * m[:, 0], -m[:, 1]))
        along_y = np.column_stack((zeros, full, -y * z, -m[:, 2] - y * m[:, 1], y * m[:, 0], m[:, 0]))
        du = (a12 * scale)[:, None] * along_y - (a22 * scale)[:, None] * along_x
        dv = (a11 * scale)[:, None] * along_y - (a21 * scale)[:, None] * along_x
        return du, dv

    def _blur_cells(self, guess: Guess, shrink: int) -> tuple[float, float, float]:
        px_u, px_v = self._px_per_cell(guess.view)
        u_px2, v_px2 = guess.blur.u_px**2, guess.blur.v_px**2
        if shrink > 1:
            # A pixel of a smaller picture has a larger area of its own.
            area = (shrink**2 - 1.0) / 12.0
            u_px2, v_px2 = u_px2 + area, v_px2 + area
        return math.sqrt(u_px2) / px_u, math.sqrt(v_px2) / px_v, guess.blur.uv_px2 / (px_u * px_v)

    def _px_per_cell(self, view: MarkerView) -> tuple[float, float]:
        """Pixels of the whole picture per cell along the marker's axes, in its middle."""
        camera, t = self._rays.camera, view.t
        along = [
            math.hypot(camera.fx_px * (r[0] - t[0] / t[2] * r[2]), camera.fy_px * (r[1] - t[1] / t[2] * r[2])) / t[2]
            for r in (view.R[:, 0], view.R[:, 1])
        ]
        return max(along[0] * self.cell_m, 1e-3), max(along[1] * self.cell_m, 1e-3)

    def _model(self, patch: Patch, guess: Guess) -> _Model:
        u, v, _ = self.places(patch.rays, guess.view)
        du, dv = self._slopes(patch.rays, guess.view, u, v)
        s_u, s_v, s_uv = self._blur_cells(guess, patch.shrink)
        shades = self.pattern.shades(u, v, s_u, s_v)
        white = shades.white + s_uv * shades.white_uv
        light = lit(white, shades, u, v, self._half, guess.edge, (s_u + s_v) / 2.0)
        columns = light.columns
        A = gram(columns)
        weights, means = _light_prior(columns.shape[1], _LEAST_NOISE)
        A.flat[:: columns.shape[1] + 1] += weights
        factors = np.asarray(
            np.linalg.solve(A, np.einsum("ij,i->j", columns, patch.brightness) + weights * means), np.float64
        )
        ink, paper, ground = light.local(factors)
        gain = paper - ink
        px_u, px_v = self._px_per_cell(guess.view)
        f_u = gain * shades.white_u + (ink - ground) * shades.board_u
        f_v = gain * shades.white_v + (ink - ground) * shades.board_v
        blurs = (
            gain * (guess.blur.u_px / px_u) ** 2 * shades.white_uu,
            gain * (guess.blur.v_px / px_v) ** 2 * shades.white_vv,
            gain / (px_u * px_v) * shades.white_uv,
        )
        jacobian = np.column_stack((f_u[:, None] * du + f_v[:, None] * dv, *blurs, columns))
        if guess.edge is not None:
            jacobian = np.column_stack((jacobian, *light.edge_slopes(factors, u, v, self._half, guess.edge)))
        residual = np.asarray(patch.brightness - np.einsum("ij,j->i", columns, factors), np.float64)
        return _Model(u, v, du, dv, shades, light, factors, patch.brightness, residual, jacobian)

    def _step(self, patch: Patch, guess: Guess, tilt: TiltPrior) -> _Step | None:
        model = self._model(patch, guess)
        J, residual = model.jacobian, model.residual
        noise2 = max(float(residual @ residual) / max(len(residual) - J.shape[1], 8), _LEAST_NOISE**2)
        M, g = gram(J) / noise2, np.einsum("ij,i->j", J, residual) / noise2
        _add_priors(M, g, guess, tilt, model.factors)
        try:
            inverse = np.linalg.inv(M)
        except np.linalg.LinAlgError:
            return None
        delta = inverse @ g
        if not np.isfinite(delta).all():
            return None
        step = delta * self._allowed(delta, guess.view)
        moved = self._moved(guess, step)
        if not moved.view.t[2] > 0.0:
            return None
        change = np.einsum("ij,j->i", model.du, step[:6]), np.einsum("ij,j->i", model.dv, step[:6])
        moved_cells = math.sqrt(float(change[0] @ change[0] + change[1] @ change[1]) / len(residual))
        return _Step(moved, moved_cells, inverse[:6, :6], model)

    def _allowed(self, delta: Array, view: MarkerView) -> float:
        """Which part of a step does not leave the region where the model is about linear."""
        shift_cells: float = float(np.abs(delta[:2]).max()) * float(view.t[2]) / self.cell_m
        return min(
            1.0,
            _LARGEST_SHIFT_CELLS / max(shift_cells, 1e-12),
            _LARGEST_TURN_RAD / max(float(np.abs(delta[3:6]).max()), 1e-12),
            _LARGEST_APPROACH / max(abs(float(delta[2])), 1e-12),
        )

    @staticmethod
    def _moved(guess: Guess, step: Array) -> Guess:
        view = guess.view
        R = np.asarray(cv2.Rodrigues(step[3:6])[0], float) @ view.R
        blur = Blur(
            _limited_blur(guess.blur.u_px, step[6]),
            _limited_blur(guess.blur.v_px, step[7]),
            guess.blur.uv_px2 + float(step[8]),
        )
        edge = guess.edge
        if edge is not None:
            turn, shift, growth = np.clip(step[-3:], -_LARGEST_EDGE_STEP, _LARGEST_EDGE_STEP).tolist()
            edge = ShadowEdge(edge.angle_rad + turn, edge.offset + shift, edge.log_factor + growth)
        return Guess(MarkerView(R, view.t + step[:3] * float(view.t[2])), blur, edge)

    def _finished(self, patch: Patch, fit: _Step) -> Alignment:
        corners = self.corners_px(fit.guess.view)
        slopes = self._corner_slopes(fit.guess.view)
        side_px = float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).mean())
        centred = fit.model.brightness - fit.model.brightness.mean()
        remaining = fit.model.residual - fit.model.residual.mean()
        total = max(float(centred @ centred), 1e-9)
        return Alignment(
            guess=fit.guess,
            corners_px=corners,
            corner_covariance_px2=_with_model_error(slopes @ fit.covariance @ slopes.T, side_px),
            likeness=math.sqrt(max(1.0 - float(remaining @ remaining) / total, 0.0)),
            unexplained_without_code=math.sqrt(
                fit.model.light.unexplained_without_code(fit.model.brightness) / len(fit.model.residual)
            ),
            plausible=_is_plausible(fit),
            light=fit.model.factors,
            residual=math.sqrt(float(fit.model.residual @ fit.model.residual) / len(fit.model.residual)),
            side_px=side_px,
            patch=patch,
            differences=fit.model.residual,
        )

    def _corner_slopes(self, view: MarkerView) -> Array:
        """Derivatives (8, 6) of the corners' pixels by (shift as a part of the distance, turn); the lens's stretching left out."""
        camera, rows, d = self._rays.camera, [], float(view.t[2])
        arms = self._corners_m @ view.R.T
        for (mx, my, mz), (x, y, z) in zip(arms, arms + view.t, strict=True):
            a, b = camera.fx_px / z, camera.fy_px / z
            rows.append([a * d, 0.0, -a * d * x / z, -a * x / z * my, a * (mz + x / z * mx), -a * my])
            rows.append([0.0, b * d, -b * d * y / z, -b * (mz + y / z * my), b * y / z * mx, b * mx])
        return np.array(rows)


def _with_model_error(covariance: Array, side_px: float) -> Array:
    """The covariance of the corners made larger by what the model misses; it stays that of a square that moves."""
    variance = max(float(np.trace(covariance)) / 8.0, 1e-12)
    enlarged: Array = covariance * (1.0 + (_MODEL_SIGMA_SIDES * side_px) ** 2 / variance)
    return enlarged


def _is_plausible(fit: _Step) -> bool:
    blur = fit.guess.blur
    return max(blur.u_px, blur.v_px) < _LARGEST_BLUR_PX and is_plausible(fit.model.factors, fit.guess.edge)


def _light_prior(columns: int, noise: float) -> tuple[Array, Array]:
    """Weights and means of what is known of the light beforehand."""
    sigmas = np.array((1e3, 1e3, _GROUND_SIGMA, _SLOPE_SIGMA, _SLOPE_SIGMA)[:columns])
    means = np.array((0.0, 0.0, _GROUND_LEVEL, 0.0, 0.0)[:columns])
    return noise**2 / np.square(sigmas), means


def _add_priors(M: Array, g: Array, guess: Guess, tilt: TiltPrior, factors: Array) -> None:
    n, wanted = guess.view.R[:, 2], tilt.normal_camera
    # How the cross product of the normal and the wanted one changes with a small turn.
    change = np.outer(n, wanted) - float(n @ wanted) * np.eye(3)
    M[3:6, 3:6] += change.T @ change / tilt.sigma_rad**2
    g[3:6] -= change.T @ _cross(n, wanted) / tilt.sigma_rad**2
    blur = guess.blur
    sigmas = np.array((_BLUR_LOG_SIGMA, _BLUR_LOG_SIGMA, _SLANT_SIGMA_PX2))
    excess = np.array((math.log(blur.u_px / _BLUR_PX), math.log(blur.v_px / _BLUR_PX), blur.uv_px2))
    diagonal = np.einsum("ii->i", M)
    diagonal[_BLURS] += sigmas**-2
    g[_BLURS] -= excess / sigmas**2
    count = len(factors)
    weights, means = _light_prior(count, 1.0)
    lights = slice(9, 9 + count)
    diagonal[lights] += weights
    g[lights] -= weights * (factors - means)
    if guess.edge is not None:
        diagonal[-3:] += np.array((_EDGE_ANGLE_SIGMA, _EDGE_OFFSET_SIGMA, _EDGE_LOG_SIGMA)) ** -2.0


def _cross(a: Array, b: Array) -> Array:
    """The vector product; NumPy's own takes ten times as long for two vectors."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))


def _limited_blur(blur_px: float, log_step: float) -> float:
    bounded = min(max(float(log_step), -_LARGEST_BLUR_STEP), _LARGEST_BLUR_STEP)
    return max(blur_px * math.exp(bounded), _LEAST_BLUR_PX)
