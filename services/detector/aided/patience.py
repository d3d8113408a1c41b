"""How often the whole frame is searched for the pattern while the pad is not in it."""

from alight.runtime.clock import nanoseconds

_EAGER_NS = nanoseconds(1.0)
_PAUSE_NS = nanoseconds(0.3)
_INTERRUPTED_NS = nanoseconds(1.0)


class Patience:
    """Says whether to search in this frame.

    Right after the pad was lost, and in the first frames, in each; after a second without it a few times a second only,
    since a search takes many times as long as following a pad that is seen, and the core is needed by others. Judged by
    the frames' own times: pictures that belong to no stream are all searched.
    """

    def __init__(self) -> None:
        self._fruitless_since_ns: int | None = None
        self._searched_ns = 0
        self._newest_ns = 0

    def allows(self, captured_at_ns: int) -> bool:
        """Whether to search in the frame of that time, UTC ns; to be asked in each frame without the pad."""
        if abs(captured_at_ns - self._newest_ns) > _INTERRUPTED_NS:
            self._fruitless_since_ns = None
        self._newest_ns = captured_at_ns
        if self._fruitless_since_ns is None:
            self._fruitless_since_ns = captured_at_ns
        eager = captured_at_ns - self._fruitless_since_ns <= _EAGER_NS
        if not eager and captured_at_ns - self._searched_ns < _PAUSE_NS:
            return False
        self._searched_ns = captured_at_ns
        return True

    def found(self) -> None:
        """The pad is in view again."""
        self._fruitless_since_ns = None
