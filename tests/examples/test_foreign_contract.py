"""What the example in examples/foreign_detector takes and what it refuses, with samples from a real Zenoh session."""

import importlib.util
import json
import queue
from pathlib import Path

import pytest
import zenoh

from schemas import topics
from schemas.detection import Detection
from schemas.frame import FrameHeader
from schemas.wire import decode, encode
from station.schema_export import export

EXAMPLE = Path(__file__).parents[2] / "examples" / "foreign_detector" / "contract.py"
HEADER = FrameHeader(captured_at_ns=5, sequence=1, width_px=4, height_px=2, source="simulated")
WIRE = encode(topics.FRAME, HEADER, bytes(8))


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("foreign_contract", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def contract(example, tmp_path_factory):
    directory = tmp_path_factory.mktemp("schemas")
    export(directory)
    return example.Contract(directory, "detector", "v7")


@pytest.fixture(scope="module")
def sample_of(contract):
    """What arrives when something is put on the key of frames; the session hears itself and nobody else."""
    config = zenoh.Config()
    for key, value in {
        **contract.index["zenoh_configuration"],
        "connect/endpoints": [],
        "listen/endpoints": [],
    }.items():
        config.insert_json5(key, json.dumps(value))
    arrived: queue.Queue[zenoh.Sample] = queue.Queue()
    with zenoh.open(config) as session:
        key = contract.topic_key("camera/frame")
        _held = session.declare_subscriber(key, arrived.put)

        def put(encoding: str, attachment: bytes | None) -> zenoh.Sample:
            session.put(key, WIRE.payload, encoding=zenoh.Encoding(encoding), attachment=attachment)
            return arrived.get(timeout=10.0)

        yield put


def test_keys_have_the_names_of_vehicle_and_service(contract):
    assert contract.topic_key("camera/frame") == topics.FRAME.key("v7")
    assert contract.topic_key("health") == topics.HEALTH.key("v7", "detector")
    assert contract.key(contract.index["alive_key_expression"]) == "alight/v7/alive/detector"


def test_a_frame_of_ours_is_read(contract, sample_of):
    header = contract.read("camera/frame", sample_of(WIRE.encoding, WIRE.attachment))
    assert FrameHeader.model_validate(header) == HEADER


@pytest.mark.parametrize(
    ("encoding", "attachment", "reason"),
    [
        (WIRE.encoding.replace(".v", ".v9"), WIRE.attachment, "these schemas are for"),
        (WIRE.encoding, None, "not JSON"),
        (WIRE.encoding, b"{", "not JSON"),
        (WIRE.encoding, b"[]", "is not of type 'object'"),
        (WIRE.encoding, WIRE.attachment.replace(b'"width_px":4', b'"width_px":-4'), "width_px"),
    ],
    ids=["version", "no header", "broken", "no message", "negative"],
)
def test_what_is_not_a_frame_of_this_version_is_refused_with_the_reason(
    example, contract, sample_of, encoding, attachment, reason
):
    sample = sample_of(encoding, attachment)
    with pytest.raises(example.UnusableError, match=reason):
        contract.read("camera/frame", sample)


def test_what_it_writes_is_read_by_ours(contract):
    message = {"captured_at_ns": 5, "hops": [], "frame_sequence": 1, "detector": "foreign", "markers": []}
    payload = contract.write("detector/detection", message)
    detection = decode(topics.DETECTION, payload, None, contract.encoding("detector/detection"))
    assert detection == Detection(captured_at_ns=5, frame_sequence=1, detector="foreign")


def test_it_writes_nothing_that_ours_would_refuse(example, contract):
    with pytest.raises(example.UnusableError, match="frame_sequence"):
        contract.write("detector/detection", {"captured_at_ns": 5, "detector": "foreign"})


def test_it_writes_no_number_that_is_none(example, contract):
    health = {
        "at_ns": 1,
        "service": "detector",
        "pid": 1,
        "inputs": [],
        "outputs": [],
        "counters": {},
        "complaints": [],
    }
    with pytest.raises(example.UnusableError, match="health"):
        contract.write("health", {**health, "uptime_s": float("nan")})
