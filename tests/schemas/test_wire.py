"""What goes onto the wire comes back equal; what is not a message of ours does not come in."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from schemas import topics
from schemas.frame import FrameHeader
from schemas.message import SCHEMA_VERSION
from schemas.setpoint import Setpoint
from schemas.truth import GroundTruth
from schemas.wire import MAX_JSON_BYTES, Refusal, RefusedError, decode, encode, encoding_of

finite = st.floats(-1e4, 1e4)


def frame_header(width_px: int = 4, height_px: int = 3) -> FrameHeader:
    return FrameHeader(captured_at_ns=1, sequence=0, width_px=width_px, height_px=height_px, source="test")


def truth(north_m: float = 1.0) -> GroundTruth:
    place = {"latitude_deg": 47.0, "longitude_deg": 8.0, "altitude_amsl_m": 489.0, "ellipsoidal_height_m": 489.0}
    return GroundTruth.model_validate(
        {
            "at_ns": 5,
            "vehicle_position": place,
            "velocity_ned_mps": (0, 0, 0),
            "q_ned_body": (1, 0, 0, 0),
            "angular_velocity_body_rps": (0, 0, 0),
            "pad_position": place,
            "pad_azimuth_rad": 0.0,
            "vehicle_from_pad_ned_m": (north_m, 0, -2),
            "touching_ground": False,
        }
    )


def refusal_of(payload: bytes, attachment: bytes | None = None, encoding: str | None = None) -> Refusal:
    encoding = encoding_of(topics.GROUND_TRUTH) if encoding is None else encoding
    with pytest.raises(RefusedError) as refused:
        decode(topics.GROUND_TRUTH, payload, attachment, encoding)
    return refused.value.refusal


@given(north_m=finite)
def test_a_message_comes_back_to_the_last_bit(north_m: float) -> None:
    sent = truth(north_m)
    wire = encode(topics.GROUND_TRUTH, sent)
    assert decode(topics.GROUND_TRUTH, wire.payload, wire.attachment, wire.encoding) == sent


def test_a_frame_travels_as_raw_pixels_with_its_header_beside_them() -> None:
    header, pixels = frame_header(), bytes(range(12))
    wire = encode(topics.FRAME, header, pixels)
    assert wire.payload == pixels
    assert decode(topics.FRAME, wire.payload, wire.attachment, wire.encoding) == header


def test_the_encoding_names_message_and_version() -> None:
    assert encoding_of(topics.GROUND_TRUTH) == f"application/json;alight.GroundTruth.v{SCHEMA_VERSION}"
    assert encoding_of(topics.FRAME) == f"application/octet-stream;alight.FrameHeader.v{SCHEMA_VERSION}"


def test_another_version_is_refused_as_such() -> None:
    payload = encode(topics.GROUND_TRUTH, truth()).payload
    other = f"application/json;alight.GroundTruth.v{SCHEMA_VERSION + 1}"
    assert refusal_of(payload, encoding=other) is Refusal.WRONG_VERSION


def test_another_message_is_refused_as_such() -> None:
    payload = encode(topics.GROUND_TRUTH, truth()).payload
    assert refusal_of(payload, encoding=encoding_of(topics.PAD_FIX)) is Refusal.WRONG_TYPE


def test_what_is_too_long_is_refused_before_it_is_parsed() -> None:
    assert refusal_of(b"[" * (MAX_JSON_BYTES + 1)) is Refusal.OVERSIZED


@pytest.mark.parametrize("token", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_no_number_that_is_none_comes_in(token: str) -> None:
    text = encode(topics.GROUND_TRUTH, truth()).payload.decode().replace("47.0", token)
    assert refusal_of(text.encode()) is Refusal.MALFORMED


@pytest.mark.parametrize("field", list(GroundTruth.model_fields))
def test_a_missing_field_is_refused(field: str) -> None:
    table = json.loads(encode(topics.GROUND_TRUTH, truth()).payload)
    del table[field]
    assert refusal_of(json.dumps(table).encode()) is Refusal.MALFORMED


@given(junk=st.binary(max_size=300))
def test_bytes_that_are_no_message_are_refused_not_fatal(junk: bytes) -> None:
    assert refusal_of(junk) is Refusal.MALFORMED


@pytest.mark.parametrize("size", [0, 11, 13])
def test_a_frame_with_too_few_or_too_many_pixels_is_refused(size: int) -> None:
    wire = encode(topics.FRAME, frame_header(), bytes(12))
    with pytest.raises(RefusedError) as refused:
        decode(topics.FRAME, bytes(size), wire.attachment, wire.encoding)
    assert refused.value.refusal is Refusal.WRONG_PIXEL_COUNT


def test_a_setpoint_topic_takes_no_pixels() -> None:
    with pytest.raises(ValueError, match="no pixels"):
        encode(topics.SETPOINT, Setpoint.model_construct(), b"x")
