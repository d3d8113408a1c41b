"""The table of topics: what must hold for every row, and who may never read what."""

import importlib
import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from alight.runtime.node import Node
from schemas import topics
from schemas.message import Message
from schemas.settings import Settings
from schemas.topics import MISSION_SERVICES, SERVICES, TOPICS, Delivery, Topic


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_every_row_is_complete(topic: Topic[Message]) -> None:
    known = SERVICES | {"station"}
    assert topic.publishers and topic.publishers <= known
    assert topic.readers and topic.readers <= known
    assert issubclass(topic.message, Message)
    assert re.fullmatch(r"alight/v1(/[a-z]+)+(/\*)?", topic.key("v1"))


def test_names_and_keys_are_unique() -> None:
    assert len({topic.name for topic in TOPICS}) == len(TOPICS)
    assert len({topic.key("v1", "x") for topic in TOPICS}) == len(TOPICS)


def test_only_frames_may_be_dropped() -> None:
    assert [topic.name for topic in TOPICS if topic.delivery is Delivery.STREAM] == [topics.FRAME.name]
    assert all(topic.has_pixels == (topic.delivery is Delivery.STREAM) for topic in TOPICS)


def test_only_the_commander_is_asked_and_only_it_sends_setpoints() -> None:
    assert topics.SETPOINT.publishers == {"commander"}
    assert topics.REQUEST.readers - {"recorder"} == {"commander"}


def test_no_row_lets_a_mission_service_but_the_renderer_read_the_ground_truth() -> None:
    assert topics.GROUND_TRUTH.readers == {"camera", "recorder", "station"}


@pytest.mark.parametrize("service", sorted(MISSION_SERVICES))
def test_no_node_of_the_mission_subscribes_to_the_ground_truth(service: str, settings: Settings) -> None:
    node: Node = importlib.import_module(f"services.{service}.service").build(settings)
    subscribes = topics.GROUND_TRUTH in node.subscriptions
    assert subscribes == (service == "camera"), "the camera's simulated source renders from it; nobody else may know it"


def test_a_camera_that_is_not_simulated_does_not_subscribe_to_the_ground_truth(tmp_path: Path) -> None:
    picture = tmp_path / "picture.png"
    cv2.imwrite(str(picture), np.zeros((480, 640), np.uint8))
    played = Settings.model_validate({"camera": {"source": "files", "files": {"paths": [str(picture)]}}})
    node = importlib.import_module("services.camera.service").build(played)
    assert topics.GROUND_TRUTH not in node.subscriptions


@pytest.mark.parametrize("service", sorted(SERVICES))
def test_a_node_that_wants_what_the_table_denies_it_cannot_be_built(service: str) -> None:
    class Curious(Node):
        pass

    Curious.service = service
    denied = [topic for topic in TOPICS if service not in topic.readers]
    for topic in denied:
        with pytest.raises(ValueError, match="may not read"):
            Curious().subscribe(topic, lambda _: ())
