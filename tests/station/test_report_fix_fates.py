"""What became of each fix: the filter and the commander's gate, asked again."""

import numpy as np
import pytest
from synthetic_flight import Flight

from alight.geometry.local import moved_by_ned
from schemas import topics
from schemas.fix import FixVerdict
from station.flight_record import FlightRecord, Logged, Provenance
from station.metrics.fix_fate import Fate, fix_fates
from station.metrics.phases import phase_spans

SETTINGS = {"filter": {"method": "none"}}


def changed(change, settings=SETTINGS) -> FlightRecord:
    """A good flight without the filter's log, in which `change` replaces messages; it gets the topic and the message."""
    record = Flight().record()
    entries = [
        (topic.name, Logged(change(topic, logged.message), logged.logged_at_ns))
        for topic in topics.TOPICS
        if topic is not topics.FUSION
        for logged in record.logged(topic)
    ]
    return FlightRecord(sorted(entries, key=lambda entry: entry[1].logged_at_ns), Provenance({}, settings))


def fates_of(record: FlightRecord):
    return fix_fates(record, phase_spans(record.messages(topics.MISSION_STATUS)))


def test_each_fix_has_one_fate_and_refusals_keep_the_geolocators_words():
    record = changed(lambda topic, message: message)
    fates = fates_of(record).fates
    fixes = record.messages(topics.PAD_FIX)
    assert [fate.captured_at_ns for fate in fates] == [fix.captured_at_ns for fix in fixes]
    for fate, fix in zip(fates, fixes, strict=True):
        assert (fate.fate is Fate.GEOLOCATOR) == (fix.verdict is not FixVerdict.ACCEPTED)
    refused = next(fate for fate in fates if fate.fate is Fate.GEOLOCATOR)
    assert (refused.reason, refused.detail) == ("no_marker", "no 5x5_1000 id 68 among 0 markers")


def test_fixes_of_the_descent_are_steered_by_and_earlier_ones_only_used():
    fates = fates_of(changed(lambda topic, message: message)).fates
    assert {fate.reason for fate in fates if fate.fate is Fate.USED} >= {"acquire"}
    assert {fate.reason for fate in fates if fate.fate is Fate.STEERED} >= {"descend"}


def test_a_fix_elsewhere_is_left_out_by_the_filter():
    fixes = Flight().record().messages(topics.PAD_FIX)
    wrong = next(fix for fix in fixes[200:] if fix.corrected)

    def move(topic, message):
        if topic is not topics.PAD_FIX or message.captured_at_ns != wrong.captured_at_ns:
            return message
        place = message.corrected.model_copy(
            update={"position": moved_by_ned(message.corrected.position, (30.0, 0.0, 0.0))}
        )
        return message.model_copy(update={"corrected": place})

    fates = {fate.captured_at_ns: fate for fate in fates_of(changed(move)).fates}
    assert fates[wrong.captured_at_ns].fate is Fate.FILTER
    assert fates[wrong.captured_at_ns].reason == "outlier"
    assert sum(fate.fate is Fate.FILTER for fate in fates.values()) == 1


def test_an_estimate_that_is_too_uncertain_is_refused_by_the_commander():
    vague = tuple((np.eye(3) * 100.0).ravel())

    def blur(topic, message):
        if topic is topics.SETPOINT:
            return message.model_copy(update={"fresh": False})
        return message.model_copy(update={"covariance_ned_m2": vague}) if topic is topics.PAD_ESTIMATE else message

    fates = [fate for fate in fates_of(changed(blur)).fates if fate.fate is not Fate.GEOLOCATOR]
    assert {fate.fate for fate in fates} <= {Fate.COMMANDER, Fate.NO_ESTIMATE}
    assert {fate.reason for fate in fates if fate.fate is Fate.COMMANDER} == {"too_uncertain"}


@pytest.mark.parametrize("settings", [{}, {"filter": {"no_such_key": 1}}])
def test_without_readable_settings_nothing_is_claimed_of_the_filter(settings):
    fates = fates_of(changed(lambda topic, message: message, settings)).fates
    assert {fate.fate for fate in fates} == {Fate.GEOLOCATOR, Fate.UNKNOWN}


def test_the_filters_own_log_is_believed_where_there_is_one():
    record = Flight().record()
    fix = next(fix for fix in record.messages(topics.PAD_FIX)[200:] if fix.corrected)
    topic = topics.FUSION
    written = [
        {"name": "active", "method": "none", "verdict": "outlier" if one is fix else "fused"}
        for one in record.messages(topics.PAD_FIX)
    ]
    log = [
        topic.message.model_validate(
            {"at_ns": one.captured_at_ns + 1, "captured_at_ns": one.captured_at_ns, "attempts": (attempt,)}
        )
        for one, attempt in zip(record.messages(topics.PAD_FIX), written, strict=True)
    ]
    entries = [(row.name, logged) for row in topics.TOPICS if row is not topics.FUSION for logged in record.logged(row)]
    entries += [(topic.name, Logged(message, message.at_ns)) for message in log]
    fates = fates_of(FlightRecord(entries, Provenance({}, SETTINGS)))
    left_out = [fate for fate in fates.fates if fate.fate is Fate.FILTER]
    assert [(fate.captured_at_ns, fate.reason) for fate in left_out] == [(fix.captured_at_ns, "outlier")]
    assert fates.repeated is None


def test_how_many_estimates_come_out_the_same_is_counted():
    """The made-up flight's estimates are every third fix; a filter that passes fixes on releases exactly these places."""
    fates = fates_of(changed(lambda topic, message: message))
    assert fates.estimates == fates.repeated > 100
    assert fates_of(changed(lambda topic, message: message, {"filter": {"method": "mean"}})).repeated < fates.estimates
