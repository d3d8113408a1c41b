"""What people ask of the commander, what it answers, and what it is doing."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from schemas.message import Nanoseconds, ShortText, Stamped, Vector3


class Phase(StrEnum):
    """The commander's states. Its transition table is in `services/commander/`."""

    IDLE = "idle"
    """Nobody asked for anything; the commander sends nothing that moves the vehicle."""
    TAKEOFF = "takeoff"
    """Arming and climbing, because a person asked for it (simulated flights)."""
    TRANSIT = "transit"
    """Flying to the point where the landing shall start."""
    ACQUIRE = "acquire"
    """Holding still until the pad's estimate is good enough to descend on."""
    DESCEND = "descend"
    """Coming down to the pad by vision."""
    TOUCHDOWN = "touchdown"
    """Below the switching height: going down until the autopilot detects the ground and disarms."""
    HOLD = "hold"
    """Holding position: the estimate went stale or missing, or somebody asked for it."""
    LANDED = "landed"
    """On the ground, disarmed."""
    ABORTED = "aborted"
    """A person or a safety rule ended the landing; the vehicle holds."""
    YIELDED = "yielded"
    """The pilot or the autopilot's failsafe took over; the commander keeps its hands off until asked again."""
    FAILED = "failed"
    """It cannot go on; the reason says why. The vehicle was told to hold if it was told anything."""


GIVEN_UP = frozenset({Phase.ABORTED, Phase.YIELDED, Phase.FAILED})
"""The phases in which the commander does not go on by itself with what it was asked."""


class Verb(StrEnum):
    """What may be asked."""

    TAKEOFF = "takeoff"
    LAND = "land"
    HOLD = "hold"
    ABORT = "abort"


class MissionRequest(Stamped):
    """Something asked of the commander. The commander answers each with a `MissionReply` of the same id."""

    request_id: Annotated[str, Field(min_length=1, max_length=64)]
    """Chosen by who asks; a repeated id is answered again but acted on once."""
    verb: Verb
    """What is asked."""
    start_ned_m: Vector3 | None = None
    """For TAKEOFF: where to fly after the climb, north, east, down of the point of takeoff, metres."""
    reason: ShortText = ""
    """Why, for the log."""


class MissionReply(Stamped):
    """The commander's answer."""

    request_id: Annotated[str, Field(min_length=1, max_length=64)]
    """The request it answers."""
    accepted: bool
    """Whether the commander acts on it."""
    reason: ShortText
    """Why, or why not."""


class MissionStatus(Stamped):
    """What the commander is doing and why; published at 5 Hz and on every change of phase."""

    phase: Phase
    """The state of the state machine."""
    phase_since_ns: Nanoseconds
    """When the phase began, UTC ns."""
    reason: ShortText
    """Why the phase began."""
    code: ShortText
    """The reason's stable name, such as `estimate_stale` or `pilot_took_over`."""
    guidance: ShortText
    """`glide` or `reposition`."""
    height_above_pad_m: float | None = None
    """Height of the vehicle above the estimated pad, metres."""
    distance_to_pad_m: float | None = None
    """Horizontal distance to the estimated pad, metres."""
    estimate_age_s: float | None = None
    """Age of the newest estimate: now minus its capture time, seconds."""
    request_id: ShortText = ""
    """The request that is being carried out."""
