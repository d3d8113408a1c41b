"""Shared memory in which frames wait to be sent: readers on this host are then only told where they lie."""

import logging
import os
from typing import Any

import zenoh
import zenoh.shm

LOGGER = logging.getLogger("alight")

MOST_FRAMES = 12
"""So many are on their way, or with readers that have not copied them yet."""
FEWEST_FRAMES = 3
"""Room for fewer is not worth having."""
MOST_BYTES = 32 * 2**20
"""A container's shared memory is 64 MB where nobody has asked for more, and there may be other cameras in it."""
SMALLEST_FRAME_BYTES = 4096

_MOUNT = "/dev/shm"


class FrameMemory:
    """Makes room when the first frame comes, for frames of its size. A frame for which there is none travels as bytes."""

    def __init__(self, *, wanted: bool) -> None:
        self._wanted = wanted
        self._size = 0
        self._provider: Any = None

    def held(self, pixels: bytes) -> Any:
        """What Zenoh is to send: the pixels in shared memory, where they need not be copied any more, or as they are."""
        if not self._wanted or len(pixels) < SMALLEST_FRAME_BYTES:
            return pixels
        if self._size != len(pixels):
            self._size = len(pixels)
            self._provider = _provider(self._size)
        if self._provider is None:
            return pixels
        try:
            buffer = self._provider.alloc(self._size, zenoh.shm.GarbageCollect())
        except zenoh.ZError:  # readers hold all of it, or have died with it
            return pixels
        buffer[:] = pixels
        return buffer


def _provider(frame_bytes: int) -> Any:
    """Shared memory for as many frames as there is room for; None if there is none."""
    frames = min(MOST_FRAMES, _room_bytes() // frame_bytes)
    obstacle = "no room"
    while frames >= FEWEST_FRAMES:
        try:
            return zenoh.shm.ShmProvider.default_backend(frames * frame_bytes)
        except zenoh.ZError as error:
            obstacle = str(error)
            frames //= 2  # it is locked in memory, of which a user may have little (`ulimit -l`, often 8 MB)
    LOGGER.info("frames travel as bytes: no shared memory", extra={"frame_bytes": frame_bytes, "detail": obstacle})
    return None


def _room_bytes() -> int:
    """What may be taken: memory that is promised but not there would end the process when a frame is written to it."""
    try:
        mount = os.statvfs(_MOUNT)
    except OSError:
        return MOST_BYTES  # another system, which has its own way
    return min(MOST_BYTES, mount.f_bavail * mount.f_frsize // 2)
