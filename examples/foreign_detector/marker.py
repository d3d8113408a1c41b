"""Finds one marker with OpenCV, and the poses that the picture of a square allows."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

CONTOUR_INSET_PX = 0.5
"""OpenCV's contours run through the centres of the outermost dark pixels; the marker's edge is half a pixel further out."""
CORNER_SIGMA_PX = 0.25
"""Standard deviation of a corner coordinate. Measured on drawn markers of 14 to 200 pixels a side: 0.13 to 0.25 with lines fitted
to the contour, against 0.34 to 0.42 without. Measure it for your camera: the filter weighs every fix by it."""
POSITION_PRIOR_M, ROTATION_PRIOR_RAD = 1000.0, 1.0
"""Keep the covariance finite where the picture says nothing, such as the tilt of a marker right below."""


@dataclass(frozen=True)
class Lens:
    """The camera as `camera/calibration` gives it."""

    size_px: tuple[int, int]
    matrix: np.ndarray
    distortion: np.ndarray

    @classmethod
    def of(cls, message: dict[str, Any]) -> "Lens":
        """From the message."""
        matrix = [[message["fx_px"], 0.0, message["cx_px"]], [0.0, message["fy_px"], message["cy_px"]], [0.0, 0.0, 1.0]]
        distortion = np.array(message.get("distortion", [0.0] * 5))
        return cls((message["width_px"], message["height_px"]), np.array(matrix), distortion)


@dataclass(frozen=True)
class PadMarker:
    """The one marker to look for."""

    family: str
    id: int
    side_m: float


class MarkerFinder:
    """OpenCV's ArUco, and the poses that a square's picture allows."""

    def __init__(self, wanted: PadMarker) -> None:
        """Set OpenCV up; reading each cell finely lets it read markers that are small in the picture."""
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
        parameters.perspectiveRemovePixelPerCell = 8
        parameters.perspectiveRemoveIgnoredMarginPerCell = 0.25
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{wanted.family.upper()}"))
        self._opencv = cv2.aruco.ArucoDetector(dictionary, parameters)
        self._wanted = wanted

    def find(self, picture: np.ndarray, lens: Lens) -> list[dict[str, Any]]:
        """The wanted marker as the message wants it; nothing else on the ground has a size that is known."""
        all_corners, ids, _ = self._opencv.detectMarkers(picture)
        seen = zip([] if ids is None else ids.ravel(), all_corners, strict=True)
        found = [marker_message(self._wanted, grown(corners), lens) for id_, corners in seen if id_ == self._wanted.id]
        return [marker for marker in found if marker is not None][:1]


def grown(corners: np.ndarray) -> np.ndarray:
    """OpenCV's corners moved out to the marker's edges; (4, 2), the upper left pixel's centre is (0, 0)."""
    corners = corners.reshape(4, 2).astype(float)
    to_next = np.roll(corners, -1, axis=0) - corners
    along = to_next / np.linalg.norm(to_next, axis=1, keepdims=True)
    return corners + CONTOUR_INSET_PX * (np.roll(along, 1, axis=0) - along)


def square_m(side_m: float) -> np.ndarray:
    """The corners in the marker's frame (x right, y up, z out of the print), upper left first, clockwise; (4, 3)."""
    return side_m / 2.0 * np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]])


def marker_message(marker: PadMarker, corners_px: np.ndarray, lens: Lens) -> dict[str, Any] | None:
    """The marker with both of its poses, the better one first; None if no pose is usable."""
    square = square_m(marker.side_m)
    solutions = planar_solutions(square, corners_px, lens)
    poses = [pose_message(square, turn, place, corners_px, lens) for turn, place in solutions]
    usable = sorted((pose for pose in poses if pose is not None), key=lambda pose: pose["reprojection_error_px"])
    if not usable:
        return None
    best, worst = usable[0]["reprojection_error_px"], usable[-1]["reprojection_error_px"]
    return {
        "family": marker.family,
        "id": marker.id,
        "side_m": marker.side_m,
        "corners_px": corners_px.tolist(),
        "corner_sigma_px": CORNER_SIGMA_PX,
        "poses": usable,
        "ambiguity": 0.0 if len(usable) == 1 else best / worst if worst > 0.0 else 1.0,
    }


def planar_solutions(square: np.ndarray, corners_px: np.ndarray, lens: Lens) -> list[tuple[np.ndarray, np.ndarray]]:
    """IPPE's two solutions, rotation vector and place, each refined to the least error.

    Where only one minimum exists, the refinement leads from both into it: the other then stays as IPPE gave it.
    """
    seen = (square, corners_px.reshape(4, 1, 2), lens.matrix, lens.distortion)
    _, turns, places, _ = cv2.solvePnPGeneric(*seen, flags=cv2.SOLVEPNP_IPPE_SQUARE)
    if not turns:
        return []
    first, *others = zip(turns, places, strict=True)
    best = cv2.solvePnPRefineLM(*seen, first[0].copy(), first[1].copy())
    refined = [cv2.solvePnPRefineLM(*seen, turn.copy(), place.copy()) for turn, place in others]
    kept = [own if same_turn(best[0], sharper[0]) else sharper for own, sharper in zip(others, refined, strict=True)]
    return [best, *kept]


def same_turn(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two rotation vectors turn the marker alike, to some thousandths of a radian."""
    return abs(float(np.dot(quaternion(one.ravel()), quaternion(other.ravel())))) > 1.0 - 1e-6


def pose_message(
    square: np.ndarray, turn: np.ndarray, place: np.ndarray, corners_px: np.ndarray, lens: Lens
) -> dict[str, Any] | None:
    """One pose with its covariance; None if it is behind the camera or no number.

    The corners, already turned, are projected with no further rotation: OpenCV's Jacobian is then the one of a small
    rotation in the camera's frame, which is what the message asks for. Covariance = (J^T J / sigma^2 + prior^-1)^-1.
    """
    turned = square @ cv2.Rodrigues(turn)[0].T
    if not np.isfinite(turned).all() or not (turned + place.ravel())[:, 2].min() > 0.0:
        return None
    projected, jacobian = cv2.projectPoints(turned, np.zeros(3), place, lens.matrix, lens.distortion)
    error_px = projected.reshape(4, 2) - corners_px
    J = np.hstack((jacobian[:, 3:6], jacobian[:, 0:3])) / CORNER_SIGMA_PX
    prior = np.diag([POSITION_PRIOR_M**-2] * 3 + [ROTATION_PRIOR_RAD**-2] * 3)
    covariance = np.linalg.inv(J.T @ J + prior)
    return {
        "position_camera_m": place.ravel().tolist(),
        "q_camera_marker": quaternion(turn.ravel()),
        "reprojection_error_px": float(np.sqrt((error_px**2).sum(axis=1).mean())),
        "covariance": ((covariance + covariance.T) / 2.0).ravel().tolist(),
    }


def quaternion(turn: np.ndarray) -> list[float]:
    """A rotation vector as a unit quaternion w, x, y, z."""
    angle_rad = float(np.linalg.norm(turn))
    return [float(np.cos(angle_rad / 2.0)), *(turn * 0.5 * np.sinc(angle_rad / 2.0 / np.pi)).tolist()]
