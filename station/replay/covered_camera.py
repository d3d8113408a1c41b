"""A camera whose lens is covered for a while: for reference flights that lose the pad."""

from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

import numpy as np

from alight.runtime.node import Node, Output, Outputs, Publication
from schemas import topics
from schemas.frame import FrameHeader

GREY = 70
"""What a covered lens shows, grey levels."""


class CoveredCamera(Node):
    """Passes another camera's frames on; those from a given time on to another show nothing."""

    service: ClassVar[str] = "camera"

    def __init__(self, camera: Node, begin_ns: int, end_ns: int) -> None:
        """Stand before a camera.

        Args:
            camera: The camera.
            begin_ns: From when on the lens is covered, UTC ns.
            end_ns: Until when, UTC ns.
        """
        super().__init__()
        self.tick_period_ns = camera.tick_period_ns
        self._camera = camera
        self._begin_ns, self._end_ns = begin_ns, end_ns
        for topic in camera.subscriptions:
            self.subscribe(topic, lambda arrival: self._covered(camera.on_message(arrival)))

    def on_tick(self, now_ns: int) -> Outputs:
        """See `Node.on_tick`."""
        return self._covered(self._camera.on_tick(now_ns))

    def _covered(self, outputs: Outputs) -> Iterator[Output]:
        for output in outputs:
            yield self._darkened(output) if isinstance(output, Publication) else output

    def _darkened(self, publication: Publication) -> Publication:
        header = publication.message
        if publication.topic is not topics.FRAME or not isinstance(header, FrameHeader) or publication.pixels is None:
            return publication
        if not self._begin_ns <= header.captured_at_ns < self._end_ns:
            return publication
        return replace(publication, pixels=np.full_like(publication.pixels, GREY))
