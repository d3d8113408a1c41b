"""A picture as it lies in a recording, made into pixels again."""

import base64
import json

import cv2
import numpy as np

from alight.runtime.node import Pixels
from services.recorder.protobuf import ProtobufError
from services.recorder.raw_image import pixels_of_raw_image

_JSON_OBJECT = b"{"


def decoded_picture(data: bytes) -> Pixels | None:
    """The picture, (height, width) or (height, width, 3) in BGR; None if it is damaged.

    Args:
        data: A foxglove.CompressedImage in JSON, or a foxglove.RawImage in Protocol Buffers, which never begins as JSON does.
    """
    if not data.startswith(_JSON_OBJECT):
        try:
            return pixels_of_raw_image(data)
        except ProtobufError:
            return None
    try:
        compressed = base64.b64decode(json.loads(data)["data"])
        found = cv2.imdecode(np.frombuffer(compressed, np.uint8), cv2.IMREAD_UNCHANGED)
    except (ValueError, KeyError, TypeError, cv2.error):
        return None
    return None if found is None else np.asarray(found, np.uint8)
