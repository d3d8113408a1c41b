"""Images and videos from disk."""

from collections.abc import Generator, Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from services.camera.picture_source import SourcedPicture

IMAGE_SUFFIXES = frozenset({".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".ppm", ".tif", ".tiff", ".webp"})
VIDEO_SUFFIXES = frozenset({".avi", ".m4v", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg", ".webm"})


class FilesError(ValueError):
    """Files that are not there, in one line with the remedy."""


def listed_files(paths: Sequence[str]) -> list[Path]:
    """The files that paths, directories and patterns stand for.

    Args:
        paths: A directory stands for the images and videos in it in the order of their names, a pattern for what it matches.

    Raises:
        FilesError: If one of them stands for nothing.
    """
    files: list[Path] = []
    for text in paths:
        path = Path(text)
        if path.is_dir():
            found = sorted(each for each in path.iterdir() if each.suffix.lower() in IMAGE_SUFFIXES | VIDEO_SUFFIXES)
        elif path.exists():
            found = [path]
        else:
            found = sorted(match for match in Path(path.anchor).glob(_relative(path)) if match.is_file())
        if not found:
            raise FilesError(f"{text}: no such image, video, directory or match")
        files.extend(found)
    return files


def _relative(pattern: Path) -> str:
    """The pattern without its root, as `Path.glob` wants it."""
    return str(pattern.relative_to(pattern.anchor)) if pattern.anchor else str(pattern)


def pictures_in(file: Path, *, mirrored: bool = False) -> Iterator[SourcedPicture | None]:
    """The pictures of one image or video file, in order; a single None if it cannot be decoded.

    Args:
        file: An image, or a video by its suffix.
        mirrored: Flip left to right.
    """
    if file.suffix.lower() in VIDEO_SUFFIXES:
        yield from _video_pictures(file, mirrored)
        return
    try:
        raw = np.fromfile(file, np.uint8)
        picture = cv2.imdecode(raw, cv2.IMREAD_ANYCOLOR) if raw.size else None
    except (OSError, cv2.error):
        picture = None
    yield None if picture is None else SourcedPicture(_flipped(picture, mirrored), file.name)


def _video_pictures(file: Path, mirrored: bool) -> Iterator[SourcedPicture | None]:
    video = cv2.VideoCapture(str(file))
    number = 0
    try:
        while True:
            there, picture = video.read()
            if not there:
                break
            yield SourcedPicture(_flipped(picture, mirrored), f"{file.name}#{number}", number)
            number += 1
    finally:
        video.release()
    if number == 0:
        yield None


def _flipped(picture: cv2.typing.MatLike, mirrored: bool) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    return np.asarray(cv2.flip(picture, 1) if mirrored else picture, np.uint8)


class FileSource:
    """Plays files one after the other; what cannot be decoded is counted and skipped."""

    def __init__(self, paths: Sequence[str], *, loop: bool = False, mirrored: bool = False) -> None:
        """List the files.

        Raises:
            FilesError: If a path stands for nothing, or none is given.
        """
        if not paths:
            raise FilesError("camera.files.paths is empty: name images, videos, directories or patterns")
        self._files = listed_files(paths)
        self._loop, self._mirrored = loop, mirrored
        self._pictures = self._all_pictures()
        self._played = 0
        self._ended = False
        self._last_undecodable = ""
        self.undecodable = 0

    def next_picture(self) -> SourcedPicture | None:
        """The next picture; None when none is left."""
        picture = next(self._pictures, None)
        self._ended = picture is None
        self._played += picture is not None
        return picture

    def complaint(self) -> str:
        """That no picture is left, or which file was skipped."""
        skipped = f"{self._last_undecodable} cannot be decoded" if self._last_undecodable else ""
        if not self._ended:
            return skipped
        return f"no pictures left after {self._played}" + (f"; {skipped}" if skipped else "")

    def close(self) -> None:
        """Let go of an open video."""
        self._pictures.close()

    def _all_pictures(self) -> Generator[SourcedPicture, None, None]:
        while True:
            before = self._played
            for file in self._files:
                for picture in pictures_in(file, mirrored=self._mirrored):
                    if picture is None:
                        self.undecodable += 1
                        self._last_undecodable = file.name
                    else:
                        yield picture
            if not self._loop or self._played == before:
                return
