"""Raw frames: every bit is kept, and what reads foxglove.RawImage reads them."""

from pathlib import Path

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClassesForFiles
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from alight.runtime.clock import LOCKSTEP_EPOCH_NS
from alight.runtime.node import Arrival
from schemas import topics
from schemas.frame import FrameHeader, PixelFormat
from schemas.settings import Settings
from services.recorder.protobuf import ProtobufError
from services.recorder.raw_image import descriptor_set, pixels_of_raw_image, raw_image
from services.recorder.service import build

CAPTURED_AT_NS = LOCKSTEP_EPOCH_NS + 123_456_789


def header(pixels: np.ndarray) -> FrameHeader:
    height, width = pixels.shape[:2]
    kind = PixelFormat.MONO8 if pixels.ndim == 2 else PixelFormat.BGR8
    return FrameHeader(
        captured_at_ns=CAPTURED_AT_NS, sequence=1, width_px=width, height_px=height, pixel_format=kind, source="test"
    )


def noise(shape: tuple[int, ...], seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, shape, np.uint8)


@given(width=st.integers(1, 90), height=st.integers(1, 90), colour=st.booleans(), seed=st.integers(0, 2**16))
def test_every_bit_comes_back(width, height, colour, seed):
    pixels = noise((height, width, 3) if colour else (height, width), seed)
    np.testing.assert_array_equal(pixels_of_raw_image(raw_image(header(pixels), pixels)), pixels)


def test_a_view_with_gaps_between_its_rows_is_kept_right():
    pixels = noise((20, 64))[::2, ::2]
    np.testing.assert_array_equal(pixels_of_raw_image(raw_image(header(pixels), pixels)), pixels)


def test_pixels_that_do_not_fit_their_header_are_refused():
    with pytest.raises(ValueError, match="the header says"):
        raw_image(header(noise((4, 4))), noise((4, 5)))


@given(st.binary(max_size=200), st.integers(0, 60))
def test_damaged_bytes_are_refused_in_order(junk, at):
    pixels = noise((3, 5))
    message = raw_image(header(pixels), pixels)
    for damaged in (junk, message[:at] + junk, message[: max(0, len(message) - 1 - at)]):
        try:
            pixels_of_raw_image(damaged)
        except ProtobufError:
            continue


def test_the_reference_implementation_reads_schema_and_message():
    described = FileDescriptorSet.FromString(descriptor_set())
    pool = DescriptorPool()
    for file in described.file:
        pool.Add(file)
    kinds = GetMessageClassesForFiles([file.name for file in described.file], pool)
    pixels = noise((6, 8, 3))
    image = kinds["foxglove.RawImage"].FromString(raw_image(header(pixels), pixels))
    assert (image.width, image.height, image.step, image.encoding, image.frame_id) == (8, 6, 24, "bgr8", "camera")
    assert image.timestamp.seconds * 10**9 + image.timestamp.nanos == CAPTURED_AT_NS
    assert image.data == pixels.tobytes()


def test_the_recording_holds_them_with_their_schema(tmp_path: Path):
    settings = Settings.model_validate({"recorder": {"directory": tmp_path, "frames": "raw"}})
    node, pixels = build(settings), noise((48, 64))
    node.on_message(Arrival(topics.FRAME, header(pixels), CAPTURED_AT_NS, CAPTURED_AT_NS, pixels))
    node.close()
    with (tmp_path / "flight.mcap").open("rb") as file:
        found = [entry for entry in make_reader(file).iter_messages() if entry[1].topic.endswith("/image")]
    ((schema, channel, message),) = found
    assert schema is not None and (schema.name, schema.encoding) == ("foxglove.RawImage", "protobuf")
    assert channel.message_encoding == "protobuf" and message.publish_time == CAPTURED_AT_NS
    np.testing.assert_array_equal(pixels_of_raw_image(message.data), pixels)
