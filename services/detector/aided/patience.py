"""How often the whole frame is searched for the pattern while the pad is not in it."""

from alight.runtime.clock import nanoseconds

_EAGER_NS = nanoseconds(1.0)
_PAUSE_NS = nanoseconds(0.3)
_EXPLAINED_PAUSE_NS = nanoseconds(1.0)
_INTERRUPTED_NS = nanoseconds(1.0)


class Patience:
    """Says whether to search in this frame.

    Right after the pad was lost, and in the first frames, in each; after a second without it a few times a second only,
    since a search takes many times as long as following a pad that is seen, and the core is needed by others. Where it is known why the
    pad is not to be seen, once a second from the beginning: what is known may be wrong. Judged by
    the frames' own times: pictures that belong to no stream are all searched.
    """

    def __init__(self) -> None:
        self._fruitless_since_ns: int | None = None
        self._searched_ns: int | None = None
        self._newest_ns = 0

    def allows(self, captured_at_ns: int, *, explained: bool = False) -> bool:
        """Whether to search in the frame of that time, UTC ns; to be asked in each frame without the pad.

        Args:
            captured_at_ns: The frame's time.
            explained: Whether what is known beforehand says that nothing will be found.
        """
        if abs(captured_at_ns - self._newest_ns) > _INTERRUPTED_NS:
            self._fruitless_since_ns = self._searched_ns = None
        self._newest_ns = captured_at_ns
        # Once the reason is gone, the pad may come into view at once.
        if explained or self._fruitless_since_ns is None:
            self._fruitless_since_ns = captured_at_ns
        eager = not explained and captured_at_ns - self._fruitless_since_ns <= _EAGER_NS
        pause_ns = _EXPLAINED_PAUSE_NS if explained else _PAUSE_NS
        if not eager and self._searched_ns is not None and captured_at_ns - self._searched_ns < pause_ns:
            return False
        self._searched_ns = captured_at_ns
        return True

    def found(self) -> None:
        """The pad is in view again."""
        self._fruitless_since_ns = None
