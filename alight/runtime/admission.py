"""The gate before a node: what is out of order, too old or from the future does not come in."""

from typing import Any

from alight.runtime.clock import nanoseconds, seconds
from schemas.message import Message
from schemas.topics import Delivery, Topic
from schemas.wire import Refusal, RefusedError


class Admission:
    """Judges the stamps of arriving messages, topic by topic (for `per_service` topics sender by sender)."""

    def __init__(self, max_clock_skew_s: float, *, any_age: bool = False) -> None:
        """Begin with nothing seen.

        Args:
            max_clock_skew_s: How far in the future a stamp may lie, seconds.
            any_age: Let in what is older than its topic allows.
        """
        self._any_age = any_age
        self._max_skew_ns = nanoseconds(max_clock_skew_s)
        self._newest_ns: dict[str, int] = {}

    def admit(self, topic: Topic[Any], message: Message, now_ns: int) -> None:
        """Let a message in, or not.

        A stamp from the future is refused, lest it shut out everything that comes after it.

        Raises:
            RefusedError: OUT_OF_ORDER, TOO_OLD or FROM_THE_FUTURE.
        """
        age_ns = now_ns - message.stamp_ns
        if age_ns < -self._max_skew_ns:
            raise RefusedError(
                Refusal.FROM_THE_FUTURE, f"speaks of {seconds(-age_ns):.3f} s from now: check the clocks"
            )
        if not self._any_age and topic.max_age_s is not None and age_ns > nanoseconds(topic.max_age_s):
            raise RefusedError(Refusal.TOO_OLD, f"speaks of {seconds(age_ns):.3f} s ago, limit {topic.max_age_s} s")
        if topic.delivery is not Delivery.EVENT:
            self._check_order(topic, message)

    def _check_order(self, topic: Topic[Any], message: Message) -> None:
        lane = f"{topic.name}/{getattr(message, 'service', '')}" if topic.per_service else topic.name
        newest_ns = self._newest_ns.get(lane, -1)
        if message.stamp_ns <= newest_ns:
            behind_s = seconds(newest_ns - message.stamp_ns)
            raise RefusedError(Refusal.OUT_OF_ORDER, f"{behind_s:.3f} s before the newest on {lane}")
        self._newest_ns[lane] = message.stamp_ns
