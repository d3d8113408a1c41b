import numpy as np
import pytest
from onnx import TensorProto

from schemas.settings.detector import Yolo
from services.detector.yolo.model import Box, OnnxModel
from services.detector.yolo.model_error import ModelError
from services.detector.yolo.places import distinct
from tests.services.detector.own_model import contrast_model, echo_model


def picture_with_a_thing(x: int, y: int, size: tuple[int, int] = (480, 640)) -> np.ndarray:
    """Something white of 16 pixels with its upper left pixel at (x, y)."""
    picture = np.full(size, 120, np.uint8)
    picture[y : y + 16, x : x + 16] = 255
    return picture


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("kind", ["float32", "uint8"])
@pytest.mark.parametrize("picked", [False, True])
def test_a_box_is_where_the_thing_is_whatever_the_model_takes_and_gives(tmp_path, channels, kind, picked) -> None:
    model = OnnxModel(
        Yolo(model=contrast_model(tmp_path / "m.onnx", channels=channels, kind=kind, picked=picked, gain=1.5))
    )
    boxes = model.boxes(picture_with_a_thing(160, 80), 0.5)
    assert len(boxes) == 4
    assert np.mean([(box.x_px, box.y_px) for box in boxes], axis=0) == pytest.approx([167.5, 87.5])
    assert all(box.width_px == pytest.approx(16.0) and box.score > 0.5 for box in boxes)


@pytest.mark.parametrize("size", [(480, 640), (240, 320), (1080, 1920), (600, 300)])
def test_a_picture_of_another_size_is_fitted_into_the_models_and_its_boxes_are_put_back(tmp_path, size) -> None:
    model = OnnxModel(Yolo(model=contrast_model(tmp_path / "m.onnx", size_px=(640, 640))))
    height, width = size
    picture = np.full(size, 120, np.uint8)
    left, top, side = width // 4, height // 2, max(size) // 8
    picture[top : top + side, left : left + side] = 255
    boxes = model.boxes(picture, 0.8)
    middle = np.mean([(box.x_px, box.y_px) for box in boxes], axis=0)
    # A block of the model is up to so many of the picture's pixels.
    block_px = 8.0 * max(size) / 640.0
    assert middle == pytest.approx([left + side / 2 - 0.5, top + side / 2 - 0.5], abs=block_px / 2)
    assert boxes[0].width_px == pytest.approx(16.0 * max(size) / 640.0, rel=0.01)


def test_overlapping_boxes_are_one_and_the_order_of_the_output_does_not_matter() -> None:
    boxes = [Box(10.0, 10.0, 20.0, 20.0, 0.5), Box(14.0, 10.0, 20.0, 20.0, 0.9), Box(80.0, 10.0, 20.0, 20.0, 0.3)]
    assert distinct(boxes, 5) == distinct(boxes[::-1], 5) == [boxes[1], boxes[2]]
    assert distinct(boxes, 1) == [boxes[1]]


def test_a_missing_file_is_one_line_with_key_and_remedy(tmp_path) -> None:
    with pytest.raises(ModelError, match=r"^detector\.yolo\.model: no file .*nowhere\.onnx: name an ONNX model.*$"):
        OnnxModel(Yolo(model=str(tmp_path / "nowhere.onnx")))


def test_no_model_is_one_line_with_key_and_remedy() -> None:
    with pytest.raises(
        ModelError, match=r"^detector\.yolo\.model: names no model: .* python -m station\.train_yolo --help$"
    ):
        OnnxModel(Yolo())


def test_a_file_that_is_no_model_is_one_line_with_key_and_remedy(tmp_path) -> None:
    (tmp_path / "text.onnx").write_text("no model\nat all")
    with pytest.raises(ModelError, match=r"^detector\.yolo\.model: .*text\.onnx cannot be read .*export it anew$"):
        OnnxModel(Yolo(model=str(tmp_path / "text.onnx")))


@pytest.mark.parametrize(
    ("shape", "kind", "complaint"),
    [
        ([1, 2, 480, 640], TensorProto.FLOAT, "takes 1x2x480x640"),
        ([4, 1, 480, 640], TensorProto.FLOAT, "takes 4x1x480x640"),
        ([1, 640], TensorProto.FLOAT, "takes 1x640"),
        ([1, 3, 640, 640], TensorProto.FLOAT16, r"takes tensor\(float16\)"),
        ([1, 3, "height", "width"], TensorProto.FLOAT, "gives 1x3x480x640"),
    ],
)
def test_a_model_that_takes_or_gives_something_else_is_refused_with_what_it_should(
    tmp_path, shape, kind, complaint
) -> None:
    file = echo_model(tmp_path / "echo.onnx", shape, kind)
    with pytest.raises(
        ModelError, match=rf"^detector\.yolo\.model: .*{complaint}; it has to take .*docs/detectors\.md"
    ):
        OnnxModel(Yolo(model=file))
