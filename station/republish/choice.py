"""Which recorded topics go onto the bus: never beside another publisher, and nothing that commands unless it is named."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from schemas import topics
from schemas.topics import Topic

REPLAY = "replay-"
"""A replay's liveliness token begins so; what follows is its own."""

BY_NAME_ONLY: Mapping[str, str] = {
    topics.REQUEST.name: "it commands",
    topics.REPLY.name: "it answers a command",
    topics.SETPOINT.name: "it commands",
    topics.HEALTH.name: "it speaks of processes that do not run",
    topics.JOURNAL.name: "it speaks of processes that do not run",
}
"""Topics that are published only if they are named, and why."""


class ChoiceError(ValueError):
    """A choice that must not be published: which topic, why, and what to do instead. One line."""


@dataclass(frozen=True)
class Choice:
    """What is published, and what is not."""

    published: tuple[str, ...]
    """Names of topics."""
    left_out: Mapping[str, str]
    """Why the others are not, by name of the topic."""


def choose(
    recorded: Collection[str], alive: Collection[str], only: Sequence[str] | None, without: Sequence[str]
) -> Choice:
    """Choose from the topics that a recording has.

    Args:
        recorded: Names of its topics.
        alive: Services that live on the bus.
        only: The names that were asked for; None for all that feed live services.
        without: Names to leave out.

    Raises:
        ChoiceError: If a name is none, if a topic asked for is not in the recording or has a living publisher, if nothing is
            left, or if another replay is under way.
    """
    if any(service.startswith(REPLAY) for service in alive):
        raise ChoiceError(
            "another replay publishes on this bus already: stop it, or replay to another --set vehicle=NAME"
        )
    for name in (*(only or ()), *without):
        if name not in topics.BY_NAME:
            raise ChoiceError(f"{name} is no topic; there are {', '.join(sorted(topics.BY_NAME))}")
    if only is not None:
        _check_asked_for(only, recorded, alive)
    published, left_out = [], {}
    for name in sorted(recorded):
        reason = _reason_against(topics.BY_NAME[name], alive, only, without)
        if reason is None:
            published.append(name)
        else:
            left_out[name] = reason
    if not published:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in left_out.items())
        raise ChoiceError(f"nothing is left to publish ({reasons or 'the recording is empty'})")
    return Choice(tuple(published), left_out)


def conflict(topic: Topic[Any], alive: Collection[str], *, named: bool) -> str | None:
    """Why a topic must not be published beside the services that live on the bus; None if it may.

    Args:
        topic: The topic.
        alive: Services that live on the bus.
        named: Whether it was asked for by name.
    """
    rival = _living_publisher(topic, alive)
    if rival is not None:
        return f"the {rival} on this bus publishes it"
    if topic is topics.PAD_ESTIMATE and "commander" in alive and not named:
        return "the commander on this bus would steer by it; only by name, with --topics"
    return None


def _living_publisher(topic: Topic[Any], alive: Collection[str]) -> str | None:
    return next((service for service in sorted(topic.publishers) if service in alive), None)


def _check_asked_for(only: Sequence[str], recorded: Collection[str], alive: Collection[str]) -> None:
    for name in only:
        if name not in recorded:
            raise ChoiceError(f"{name} is not in the recording; there are {', '.join(sorted(recorded))}")
        rival = _living_publisher(topics.BY_NAME[name], alive)
        if rival is not None:
            raise ChoiceError(f"{name} is published by the {rival} on this bus: stop it first, or leave the topic out")


def _reason_against(
    topic: Topic[Any], alive: Collection[str], only: Sequence[str] | None, without: Sequence[str]
) -> str | None:
    if topic.name in without or (only is not None and topic.name not in only):
        return "not chosen"
    if only is None and topic.name in BY_NAME_ONLY:
        return f"{BY_NAME_ONLY[topic.name]}; only by name, with --topics"
    return conflict(topic, alive, named=only is not None)
