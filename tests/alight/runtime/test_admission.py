"""The gate: order, age and the future."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.runtime.admission import Admission
from alight.runtime.clock import NS_PER_S, nanoseconds
from schemas import topics
from schemas.calibration import CameraCalibration
from schemas.frame import FrameHeader
from schemas.mission import MissionRequest, Verb
from schemas.wire import Refusal, RefusedError

NOW_NS = 1_000 * NS_PER_S


def frame(captured_at_ns: int) -> FrameHeader:
    return FrameHeader(captured_at_ns=captured_at_ns, sequence=0, width_px=1, height_px=1, source="test")


def request(at_ns: int) -> MissionRequest:
    return MissionRequest(at_ns=at_ns, request_id="r", verb=Verb.LAND)


def refusal(admission: Admission, topic: topics.Topic, message: object) -> Refusal | None:
    try:
        admission.admit(topic, message, NOW_NS)
    except RefusedError as error:
        return error.refusal
    return None


@given(ages_ms=st.lists(st.integers(0, 4000), min_size=1, max_size=30))
def test_what_is_let_in_is_strictly_in_order(ages_ms: list[int]) -> None:
    admission = Admission(max_clock_skew_s=0.2)
    newest_ns = -1
    for age_ms in ages_ms:
        stamp_ns = NOW_NS - age_ms * 1_000_000
        outcome = refusal(admission, topics.FRAME, frame(stamp_ns))
        assert outcome is (None if stamp_ns > newest_ns else Refusal.OUT_OF_ORDER)
        newest_ns = max(newest_ns, stamp_ns)


def test_a_stamp_from_the_future_does_not_shut_out_what_follows() -> None:
    admission = Admission(max_clock_skew_s=0.2)
    assert refusal(admission, topics.FRAME, frame(NOW_NS + nanoseconds(0.3))) is Refusal.FROM_THE_FUTURE
    assert refusal(admission, topics.FRAME, frame(NOW_NS)) is None


def test_an_old_request_is_refused_however_often_it_comes() -> None:
    admission = Admission(max_clock_skew_s=0.2)
    old = request(NOW_NS - nanoseconds(6.0))
    assert refusal(admission, topics.REQUEST, old) is Refusal.TOO_OLD
    assert refusal(admission, topics.REQUEST, old) is Refusal.TOO_OLD


def test_who_takes_any_age_is_given_the_old_but_still_nothing_from_the_future() -> None:
    admission = Admission(max_clock_skew_s=0.2, any_age=True)
    assert refusal(admission, topics.REQUEST, request(NOW_NS - nanoseconds(600.0))) is None
    assert refusal(admission, topics.REQUEST, request(NOW_NS + nanoseconds(0.3))) is Refusal.FROM_THE_FUTURE


def test_events_need_no_order() -> None:
    admission = Admission(max_clock_skew_s=0.2)
    assert refusal(admission, topics.REQUEST, request(NOW_NS)) is None
    assert refusal(admission, topics.REQUEST, request(NOW_NS - nanoseconds(1.0))) is None


def test_a_calibration_may_be_as_old_as_it_likes() -> None:
    calibration = CameraCalibration(at_ns=0, width_px=1, height_px=1, fx_px=1, fy_px=1, cx_px=0, cy_px=0)
    assert refusal(Admission(0.2), topics.CALIBRATION, calibration) is None


@pytest.mark.parametrize("skew_s", [0.01, 0.2, 1.0])
def test_the_tolerated_skew_is_the_setting(skew_s: float) -> None:
    assert refusal(Admission(skew_s), topics.FRAME, frame(NOW_NS + nanoseconds(skew_s * 0.99))) is None
    assert refusal(Admission(skew_s), topics.FRAME, frame(NOW_NS + nanoseconds(skew_s * 1.01))) is not None
