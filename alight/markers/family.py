"""Marker families by name: OpenCV's predefined dictionaries, spelled as settings and messages spell them."""

import difflib
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

_PREFIX = "DICT_"


class FamilyError(ValueError):
    """A marker family that does not exist or cannot be read, in one line with the remedy."""


def families() -> tuple[str, ...]:
    """The names there are, such as `5x5_1000` and `apriltag_36h11`, sorted."""
    return tuple(sorted(name.removeprefix(_PREFIX).lower() for name in dir(cv2.aruco) if name.startswith(_PREFIX)))


def dictionary(family: str) -> cv2.aruco.Dictionary:
    """The dictionary of a family.

    Args:
        family: A name from `families`, in upper or lower case.

    Raises:
        FamilyError: If there is no such family.
    """
    names = {name.lower(): name for name in dir(cv2.aruco) if name.startswith(_PREFIX)}
    name = names.get(f"{_PREFIX}{family}".lower())
    if name is None:
        near = difflib.get_close_matches(family.lower(), families(), n=1, cutoff=0.5)
        hint = f"did you mean {near[0]}?" if near else f"there are: {', '.join(families())}"
        raise FamilyError(f"no marker family {family!r}: {hint}")
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


def dictionary_from_file(path: Path) -> cv2.aruco.Dictionary:
    """A dictionary of one's own, in OpenCV's YAML layout (nmarkers, markersize, marker_0, ...).

    Raises:
        FamilyError: If the file cannot be read or holds no dictionary.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise FamilyError(f"{path}: cannot be read as a dictionary of markers: {error}") from None
    own = cv2.aruco.Dictionary()
    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        complete = own.readDictionary(storage.root())
    except (cv2.error, SystemError):
        complete = False
    if not complete:
        raise FamilyError(f"{path}: holds no dictionary of markers (nmarkers, markersize, marker_0, ...)")
    return own


def marker_cells(family: str, number: int) -> NDArray[np.uint8]:
    """The cells of one marker with its black border of one cell, 0 for black and 1 for white, first row on top.

    Returns:
        (n + 2, n + 2) for a code of n x n cells.

    Raises:
        FamilyError: If there is no such family, or no such marker in it.
    """
    return cells_of(dictionary(family), number, family)


def cells_of(codes: cv2.aruco.Dictionary, number: int, family: str) -> NDArray[np.uint8]:
    """The same for any dictionary; `family` is its name, for the message."""
    count = codes.bytesList.shape[0]
    if not 0 <= number < count:
        raise FamilyError(f"family {family} has the markers 0 to {count - 1}, not {number}")
    side = codes.markerSize + 2
    picture = cv2.aruco.generateImageMarker(codes, number, side, borderBits=1)
    return (np.asarray(picture) > 127).astype(np.uint8)
