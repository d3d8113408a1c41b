"""Running an ONNX model on one picture: what it may take and what it may give."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import onnxruntime
from numpy.typing import NDArray

from schemas.settings.detector import Yolo
from services.detector.detector import GreyPicture
from services.detector.yolo.model_error import ModelError

Array = NDArray[np.float64]

_KEY = "detector.yolo.model"
_FULL_SCALE = {"tensor(float)": 255.0, "tensor(uint8)": 1.0}
"""What white is divided by, by the type of the input."""
_BEYOND = 114
"""What a picture is filled up with, grey levels: what Ultralytics' models were trained with."""
_STRIDE_PX = 32
"""Pictures of a model that takes any size are filled up to a multiple of this."""
_PROBE_PX = (480, 640)


@dataclass(frozen=True)
class Box:
    """Where the model sees something."""

    x_px: float
    y_px: float
    """Its centre in the picture; the upper left pixel's centre is (0, 0)."""
    width_px: float
    height_px: float
    score: float
    """Of its likeliest class, 0 to 1."""


@dataclass(frozen=True)
class _Fitted:
    """A picture as the model wants it."""

    data: NDArray[np.uint8] | NDArray[np.float32]
    """(1, channels, height, width)."""
    scale: float
    """How much larger it is than the picture."""
    left_px: float
    top_px: float
    """Where the picture begins in it."""


class OnnxModel:
    """A model with one picture as input and boxes as output, on the processor.

    Input: (1, 1 or 3, height, width), float32 from 0 to 1 or uint8; sizes that the model leaves open are taken from the picture.
    Output, the first one: (1, 4 + classes, N), each column x, y, width, height and a score a class (Ultralytics' detectors from v8 on), or
    (1, N, 6), each row left, top, right, bottom, score and class (models that pick among their boxes themselves). In pixels of the
    input, whose upper left corner is (0, 0).
    """

    def __init__(self, settings: Yolo) -> None:
        """Load it and try it on an empty picture.

        Raises:
            ModelError: If the file is missing, is no model, or its input or output is another.
        """
        self._name = settings.model
        self._session = _session(settings)
        inputs = self._session.get_inputs()
        if len(inputs) != 1:
            raise self._unfit(f"has {len(inputs)} inputs")
        self._input, shape, kind = inputs[0].name, inputs[0].shape, inputs[0].type
        if len(shape) != 4 or shape[1] not in (1, 3) or (isinstance(shape[0], int) and shape[0] != 1):
            raise self._unfit(f"takes {_shown(shape)}")
        if kind not in _FULL_SCALE:
            raise self._unfit(f"takes {kind}")
        self._full_scale = _FULL_SCALE[kind]
        self._channels = int(shape[1])
        self._height, self._width = (size if isinstance(size, int) else None for size in shape[2:])
        self._output = self._session.get_outputs()[0].name
        self.boxes(np.zeros(_PROBE_PX, np.uint8), 1.0)

    def boxes(self, picture: GreyPicture, least_score: float) -> list[Box]:
        """What it sees, in any order, and without its boxes picked from.

        Args:
            picture: (height, width).
            least_score: Below it nothing counts.

        Raises:
            ModelError: If it cannot be run or gives something else than boxes.
        """
        fitted = self._fitted(picture)
        try:
            raw = np.asarray(self._session.run([self._output], {self._input: fitted.data})[0])
        except Exception as error:  # the runtime's errors have no base of their own
            raise self._unfit(
                f"does not run on a picture of {picture.shape[1]}x{picture.shape[0]} ({_line(error)})"
            ) from None
        middles, sizes, scores = self._read(raw)
        likely = np.flatnonzero(scores >= least_score)
        middles = (middles[likely] - (fitted.left_px, fitted.top_px)) / fitted.scale - 0.5
        rows = np.column_stack((middles, sizes[likely] / fitted.scale, scores[likely]))
        return [Box(*row) for row in rows[np.isfinite(rows).all(axis=1)].tolist()]

    def _fitted(self, picture: GreyPicture) -> _Fitted:
        """Enlarged or made smaller until it fits a model of fixed size, then filled up at its edges."""
        height, width = picture.shape
        tall, wide = self._height or _filled_up(height), self._width or _filled_up(width)
        scale = min(wide / width, tall / height)
        if self._height is None and self._width is None:
            scale = 1.0
        if scale != 1.0:
            size = (min(round(width * scale), wide), min(round(height * scale), tall))
            method = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_LINEAR
            picture = np.asarray(cv2.resize(picture, size, interpolation=method), np.uint8)
        top, left = (tall - picture.shape[0]) // 2, (wide - picture.shape[1]) // 2
        whole = np.full((tall, wide), _BEYOND, np.uint8)
        whole[top : top + picture.shape[0], left : left + picture.shape[1]] = picture
        data = np.broadcast_to(whole, (1, self._channels, tall, wide))
        if self._full_scale != 1.0:
            return _Fitted(data.astype(np.float32) * np.float32(1.0 / self._full_scale), scale, left, top)
        return _Fitted(np.ascontiguousarray(data), scale, left, top)

    def _read(self, raw: NDArray[np.generic]) -> tuple[Array, Array, Array]:
        """Centres (N, 2), sizes (N, 2) and scores (N,) of an output."""
        if raw.ndim != 3 or raw.shape[0] != 1 or raw.dtype.kind != "f":
            raise self._unfit(f"gives {_shown(raw.shape)}")
        boxes = raw[0].astype(np.float64)
        if boxes.shape[1] == 6:
            return (boxes[:, :2] + boxes[:, 2:4]) / 2.0, boxes[:, 2:4] - boxes[:, :2], boxes[:, 4]
        if 5 <= boxes.shape[0] < boxes.shape[1]:
            return boxes[:2].T, boxes[2:4].T, boxes[4:].max(axis=0)
        raise self._unfit(f"gives {_shown(raw.shape)}")

    def _unfit(self, what: str) -> ModelError:
        return ModelError(
            f"{_KEY}: {self._name}: {what}; it has to take 1x1xHxW or 1x3xHxW (float32 or uint8) and give 1x(4+classes)xN or 1xNx6: "
            "see docs/detectors.md"
        )


def _session(settings: Yolo) -> onnxruntime.InferenceSession:
    file = Path(settings.model)
    if not settings.model:
        raise ModelError(
            f"{_KEY}: names no model: name an ONNX file, or train one: python -m station.train_yolo --help"
        )
    if not file.is_file():
        raise ModelError(
            f"{_KEY}: no file {file}: name an ONNX model, or train one: python -m station.train_yolo --help"
        )
    return _loaded(file, settings.threads)


def _loaded(file: Path, threads: int) -> onnxruntime.InferenceSession:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.log_severity_level = 4  # what is wrong is said by what is raised
    try:
        return onnxruntime.InferenceSession(file, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # the runtime's errors have no base of their own
        raise ModelError(f"{_KEY}: {file} cannot be read as an ONNX model ({_line(error)}): export it anew") from None


def _filled_up(size_px: int) -> int:
    return -(-size_px // _STRIDE_PX) * _STRIDE_PX


def _shown(shape: object) -> str:
    return "x".join(str(size) for size in shape) if isinstance(shape, (list, tuple)) else str(shape)


def _line(error: Exception) -> str:
    return " ".join(str(error).split())[:200]
