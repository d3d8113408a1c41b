"""What became of each fix: refused by the geolocator, left out by the filter, refused by the commander, or flown.

The filter keeps a log of that. Where a recording lacks it, the filter is asked again with the recorded messages, and the
commander's gate, which keeps no log, always is, with the recorded estimates: both are pure.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from pydantic import ValidationError

from alight.geometry.local_frame import LocalFrame
from alight.runtime.clock import nanoseconds
from alight.runtime.node import Arrival, Node, Publication
from schemas import topics
from schemas.estimate import PadEstimate
from schemas.fix import FixVerdict, PadFix
from schemas.fusion import FusionVerdict
from schemas.message import Message
from schemas.mission import MissionReply, Phase, Verb
from schemas.settings import Settings
from schemas.topics import Topic
from schemas.vehicle import VehicleState
from services.commander.estimate_gate import EstimateGate, Verdict
from services.filter.service import build as build_filter
from station.flight_record import FlightRecord
from station.metrics.phases import PhaseSpan

_USED = "fix_used"
_TAKEN = frozenset({FusionVerdict.STARTED, FusionVerdict.FUSED, FusionVerdict.COLLECTED, FusionVerdict.REINITIALISED})
"""Verdicts of the filter's log by which a fix is in its next estimate."""
_BELONGS_WITHIN_NS = nanoseconds(2.0)
"""A fix that no estimate followed for this long is in none."""


class Fate(StrEnum):
    """How far a fix came."""

    STEERED = "steered by"
    """A setpoint followed from the first estimate with it."""
    USED = "used, not steered by"
    """In an estimate that the commander accepted, but no setpoint was due."""
    NO_ESTIMATE = "in no estimate"
    """The filter took it, and released nothing afterwards."""
    COMMANDER = "refused by the commander"
    FILTER = "left out by the filter"
    GEOLOCATOR = "refused by the geolocator"
    UNKNOWN = "accepted, then unknown"
    """The recording lacks the settings that say what the filter did."""


@dataclass(frozen=True)
class FixFate:
    """One fix and what became of it."""

    captured_at_ns: int
    fate: Fate
    reason: str
    """The stable name of the verdict of who refused it, or the phase of the mission."""
    detail: str = ""
    """In words, where the geolocator gave any."""


@dataclass(frozen=True)
class FixFates:
    """All fixes of a flight."""

    fates: tuple[FixFate, ...]
    """In the order of recording."""
    estimates: int
    """How many estimates are recorded."""
    repeated: int | None
    """How many of them the filter, asked again, releases to the last digit; fewer mean that it had forgotten or missed something.
    None if its log says it all, or there are no settings to ask it with."""

    def within(self, began_at_ns: int, ended_at_ns: int) -> "FixFates":
        """The fixes captured between two times, UTC ns."""
        chosen = tuple(fate for fate in self.fates if began_at_ns <= fate.captured_at_ns <= ended_at_ns)
        return FixFates(chosen, self.estimates, self.repeated)


def fix_fates(record: FlightRecord, spans: Sequence[PhaseSpan]) -> FixFates:
    """Follow every fix of a recording."""
    settings = _settings(record)
    fixes = record.messages(topics.PAD_FIX)
    estimates = {estimate.captured_at_ns: estimate for estimate in record.messages(topics.PAD_ESTIMATE)}
    if settings is None:
        return FixFates(tuple(_unknown(fix) for fix in fixes), len(estimates), None)
    filtered, repeated = _log(record), None
    if any(fix.captured_at_ns not in filtered for fix in fixes):
        asked, released = _ask_filter(record, build_filter(settings))
        filtered = asked | filtered
        repeated = sum(
            released[at_ns].position == estimate.position for at_ns, estimate in estimates.items() if at_ns in released
        )
    later = _Later(record, settings, spans)
    fates = tuple(_fate(fix, filtered[fix.captured_at_ns], later) for fix in fixes)
    return FixFates(fates, len(estimates), repeated)


def _settings(record: FlightRecord) -> Settings | None:
    if not record.provenance.settings:
        return None
    try:
        return Settings.model_validate(record.provenance.settings)
    except ValidationError:
        return None


def _unknown(fix: PadFix) -> FixFate:
    refused = fix.verdict is not FixVerdict.ACCEPTED
    return FixFate(fix.captured_at_ns, Fate.GEOLOCATOR if refused else Fate.UNKNOWN, fix.verdict.value, fix.detail)


def _fate(fix: PadFix, filtered: str, later: "_Later") -> FixFate:
    if fix.verdict is not FixVerdict.ACCEPTED:
        return FixFate(fix.captured_at_ns, Fate.GEOLOCATOR, fix.verdict.value, fix.detail)
    if filtered not in _TAKEN:
        return FixFate(fix.captured_at_ns, Fate.FILTER, filtered)
    return later.fate(fix.captured_at_ns)


def _log(record: FlightRecord) -> dict[int, str]:
    """The verdict of the filter that steers on each fix, by capture time, from its log; empty if the recording has none."""
    written = record.messages(topics.FUSION)
    return {
        entry.captured_at_ns: entry.attempts[0].verdict.value for entry in written if entry.captured_at_ns is not None
    }


def _ask_filter(record: FlightRecord, node: Node) -> tuple[dict[int, str], dict[int, PadEstimate]]:
    """What the filter counted each fix as, by capture time, and the estimates that it releases."""
    counted: dict[int, str] = {}
    released: dict[int, PadEstimate] = {}
    for topic, message, heard_ns in _in_order(record, node.subscriptions):
        before = dict(node.counters())
        outputs = node.on_message(Arrival(topic, message, heard_ns, heard_ns))
        for output in outputs:
            if isinstance(output, Publication) and isinstance(output.message, PadEstimate):
                released[output.message.captured_at_ns] = output.message
        if isinstance(message, PadFix):
            counted[message.captured_at_ns] = _counted_as(before, node.counters())
    return counted, released


def _counted_as(before: Mapping[str, int], after: Mapping[str, int]) -> str:
    """A verdict by the counter of fixes that rose; in the first window several may sink at once, which keeps a fix used."""
    risen = [name for name, count in after.items() if name.startswith("fix_") and count > before.get(name, 0)]
    return FusionVerdict.FUSED.value if _USED in risen or not risen else risen[0].removeprefix("fix_")


def _in_order(record: FlightRecord, wanted: Sequence[Topic[Any]]) -> Iterator[tuple[Topic[Any], Message, int]]:
    heard = [(logged.logged_at_ns, topic, logged.message) for topic in wanted for logged in record.logged(topic)]
    for heard_ns, topic, message in sorted(heard, key=lambda one: one[0]):
        yield topic, message, heard_ns


class _Later:
    """What became of a fix after the filter."""

    def __init__(self, record: FlightRecord, settings: Settings, spans: Sequence[PhaseSpan]) -> None:
        self._spans = spans
        self._steered = {setpoint.captured_at_ns for setpoint in record.messages(topics.SETPOINT) if setpoint.fresh}
        self._verdicts = _ask_gate(record, EstimateGate(settings.commander.gate))
        self._estimates_ns = np.array(sorted(self._verdicts), np.int64)

    def fate(self, captured_at_ns: int) -> FixFate:
        """The fate of a fix that the filter used."""
        index = int(np.searchsorted(self._estimates_ns, captured_at_ns))
        late = index == len(self._estimates_ns) or self._estimates_ns[index] - captured_at_ns > _BELONGS_WITHIN_NS
        if late:
            return FixFate(captured_at_ns, Fate.NO_ESTIMATE, "none_released")
        estimate_ns = int(self._estimates_ns[index])
        if estimate_ns in self._steered:
            return FixFate(captured_at_ns, Fate.STEERED, self._phase(captured_at_ns))
        verdict = self._verdicts[estimate_ns]
        if verdict is not Verdict.ACCEPTED:
            return FixFate(captured_at_ns, Fate.COMMANDER, verdict.value)
        return FixFate(captured_at_ns, Fate.USED, self._phase(captured_at_ns))

    def _phase(self, at_ns: int) -> str:
        begun = [span.phase for span in self._spans if span.began_at_ns <= at_ns]
        return (begun[-1] if begun else Phase.IDLE).value


def _ask_gate(record: FlightRecord, gate: EstimateGate) -> dict[int, Verdict]:
    """The gate's verdict on each estimate, by capture time; it begins anew when a landing is asked for."""
    verdicts: dict[int, Verdict] = {}
    here: LocalFrame | None = None
    asked = {request.request_id for request in record.messages(topics.REQUEST) if request.verb is Verb.LAND}
    wanted = (topics.VEHICLE_STATE, topics.REPLY, topics.PAD_ESTIMATE)
    for _, message, _ in _in_order(record, wanted):
        if isinstance(message, VehicleState):
            here = LocalFrame(message.position)
        elif isinstance(message, PadEstimate):
            verdicts[message.captured_at_ns] = gate.offer(message, here)
        elif isinstance(message, MissionReply) and message.accepted and message.request_id in asked:
            gate.forget()
    return verdicts
