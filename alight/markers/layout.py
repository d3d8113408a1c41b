"""Pad layouts: which markers a pad carries, and where."""

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from alight.markers.charuco import Charuco
from alight.markers.family import FamilyError, dictionary
from schemas.settings.pad import PadSettings

_SHIPPED = Path(__file__).parent / "layouts"
_QUIET_SIDES = 0.15
_MOST_MARKERS = 200
_ROUNDING_M = 1e-9
_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)

Metres = Annotated[float, Field(ge=-100.0, le=100.0)]
Length = Annotated[float, Field(gt=0.0, le=100.0)]


class LayoutError(ValueError):
    """A layout that cannot be used: file, key and remedy in one line."""


@dataclass(frozen=True)
class PlacedMarker:
    """One marker on the pad. The pad's frame: origin in the board's centre, x right, y up in the print, z out of it."""

    __pydantic_config__ = _STRICT

    family: str
    """Marker family, such as `5x5_1000`."""
    id: Annotated[int, Field(ge=0)]
    """The marker's number in its family."""
    side_m: Length
    """Length of the marker's black outer edge, metres."""
    x_m: Metres = 0.0
    """Its centre, to the right of the pad's, metres."""
    y_m: Metres = 0.0
    """Its centre, above the pad's in the print, metres."""
    rotation_rad: Annotated[float, Field(ge=-math.tau, le=math.tau)] = 0.0
    """How far its print is turned about z, counter-clockwise for who looks at the print, rad."""

    def corners_m(self) -> NDArray[np.float64]:
        """Upper left, upper right, lower right and lower left corner of the marker's own print, pad frame, (4, 3), metres."""
        half = self.side_m / 2.0
        upright = np.array([[-half, half], [half, half], [half, -half], [-half, -half]])
        c, s = math.cos(self.rotation_rad), math.sin(self.rotation_rad)
        turned = upright @ np.array([[c, s], [-s, c]]) if self.rotation_rad else upright
        return np.column_stack((turned[:, 0] + self.x_m, turned[:, 1] + self.y_m, np.zeros(4)))


@dataclass(frozen=True)
class InkSquare:
    """A plain black square, upright; markers lie over it."""

    side_m: float
    x_m: float
    """Its centre, to the right of the pad's, metres."""
    y_m: float
    """Its centre, above the pad's in the print, metres."""

    def outline_m(self) -> NDArray[np.float64]:
        """Its corners around, pad frame, (4, 2), metres."""
        half = self.side_m / 2.0
        x, y = self.x_m, self.y_m
        return np.array([[x - half, y + half], [x + half, y + half], [x + half, y - half], [x - half, y - half]])


@dataclass(frozen=True)
class PadLayout:
    """All that is printed on a pad. Where markers overlap, the smaller one is printed over the larger."""

    name: str
    """Name of a shipped layout, path of a file, or `single`."""
    markers: tuple[PlacedMarker, ...]
    """The markers, largest first; no two alike."""
    board_m: float
    """Edge of the white square board that they are printed on, metres."""
    ink: tuple[InkSquare, ...] = ()
    """What is black beside the markers."""
    charuco: Charuco | None = None
    """The chessboard that the markers stand on, if they do."""

    @property
    def families(self) -> tuple[str, ...]:
        """The marker families on it, each once, that of the largest marker first."""
        return tuple(dict.fromkeys(marker.family for marker in self.markers))

    def levels(self) -> tuple[tuple[PlacedMarker, ...], ...]:
        """The markers by how many others they lie on, the undermost first.

        OpenCV gives up a marker as soon as it has read one inside it, so a detector of its kind has to look for one level at a time.
        """
        depth: dict[PlacedMarker, int] = {}
        for marker in self.markers:
            under = [level for other, level in depth.items() if _lies_on(marker, other)]
            depth[marker] = 1 + max(under, default=-1)
        return tuple(
            tuple(marker for marker in self.markers if depth[marker] == level)
            for level in range(max(depth.values()) + 1)
        )

    def find(self, family: str, number: int) -> PlacedMarker | None:
        """The marker of that family and number; None if the pad has none."""
        return next((marker for marker in self.markers if (marker.family, marker.id) == (family, number)), None)


def _lies_on(marker: PlacedMarker, larger: PlacedMarker) -> bool:
    """Whether its middle is inside the other's outer edge."""
    x_m, y_m = marker.x_m - larger.x_m, marker.y_m - larger.y_m
    c, s = math.cos(larger.rotation_rad), math.sin(larger.rotation_rad)
    return max(abs(c * x_m + s * y_m), abs(c * y_m - s * x_m)) < larger.side_m / 2.0


def layout_from(pad: PadSettings) -> PadLayout:
    """The layout that the settings name, or their single marker where they name none.

    Raises:
        LayoutError: If the layout is missing or wrong.
        FamilyError: If there is no such marker family, or no such marker in it.
    """
    if pad.layout:
        return read_layout(pad.layout)
    single = PlacedMarker(pad.family, pad.id, pad.side_m)
    _check_code(single)
    return PadLayout("single", (single,), pad.side_m * (1.0 + 2.0 * _QUIET_SIDES))


def shipped_layouts() -> tuple[str, ...]:
    """Names of the layouts that come with the program, sorted."""
    return tuple(sorted(path.stem for path in _SHIPPED.glob("*.toml")))


def read_layout(name: str) -> PadLayout:
    """Read a layout.

    Args:
        name: Name of a shipped layout, or path of a TOML file with `board_m` and either tables `[[marker]]` of the keys of
            `PlacedMarker` or one table `[charuco]` of the keys of `Charuco`.

    Raises:
        LayoutError: If it is missing or wrong.
    """
    path = _SHIPPED / f"{name}.toml" if name in shipped_layouts() else Path(name)
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        there_are = ", ".join(shipped_layouts())
        raise LayoutError(
            f"pad layout {name!r}: no such file ({error.strerror}); shipped layouts are {there_are}"
        ) from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise LayoutError(f"{path}: not valid TOML: {error}") from None
    return _checked(name, path, table)


@dataclass(frozen=True)
class _File:
    __pydantic_config__ = _STRICT

    board_m: Length
    marker: Annotated[tuple[PlacedMarker, ...], Field(max_length=_MOST_MARKERS)] = ()
    charuco: Charuco | None = None


_FILE: TypeAdapter[_File] = TypeAdapter(_File)


def _checked(name: str, path: Path, table: dict[str, Any]) -> PadLayout:
    try:
        file = _FILE.validate_python(table)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        raise LayoutError(f"{path}: {key}: {first['msg']} (got {first['input']!r})") from None
    if bool(file.marker) == (file.charuco is not None):
        raise LayoutError(f"{path}: give the print either as tables [[marker]] or as one table [charuco]")
    if file.charuco is not None:
        return _charuco_layout(name, path, file.board_m, file.charuco)
    _check_markers(path, file.marker, file.board_m)
    return PadLayout(name, tuple(sorted(file.marker, key=lambda marker: -marker.side_m)), file.board_m)


def _check_markers(path: Path, markers: tuple[PlacedMarker, ...], board_m: float) -> None:
    seen: set[tuple[str, int]] = set()
    for marker in markers:
        what = f"{path}: marker {marker.family} {marker.id}"
        try:
            _check_code(marker)
        except FamilyError as error:
            raise LayoutError(f"{path}: {error}") from None
        if (marker.family, marker.id) in seen:
            raise LayoutError(f"{what} is there twice: a pad cannot tell two equal markers apart")
        if np.abs(marker.corners_m()).max() > board_m / 2.0 + _ROUNDING_M:
            raise LayoutError(f"{what} reaches beyond the board: enlarge board_m ({board_m:g} m)")
        seen.add((marker.family, marker.id))


def _charuco_layout(name: str, path: Path, board_m: float, charuco: Charuco) -> PadLayout:
    if max(charuco.columns, charuco.rows) * charuco.square_m > board_m + _ROUNDING_M:
        raise LayoutError(f"{path}: the chessboard reaches beyond the board: enlarge board_m ({board_m:g} m)")
    try:
        places = charuco.marker_places()
    except ValueError as error:  # a FamilyError is one, too
        raise LayoutError(f"{path}: charuco: {error}") from None
    markers = tuple(PlacedMarker(charuco.family, number, charuco.marker_m, x_m, y_m) for number, x_m, y_m in places)
    ink = tuple(InkSquare(charuco.square_m, x_m, y_m) for x_m, y_m in charuco.black_squares())
    return PadLayout(name, markers, board_m, ink, charuco)


def _check_code(marker: PlacedMarker) -> None:
    count = dictionary(marker.family).bytesList.shape[0]
    if marker.id >= count:
        raise FamilyError(f"family {marker.family} has the markers 0 to {count - 1}, not {marker.id}")
