"""Tiny ONNX models as a user may bring them, made with `onnx` where a test needs one."""

from pathlib import Path

import numpy as np
from onnx import TensorProto, helper, numpy_helper, save

GROUND = 120.0 / 255.0
CELL_PX = 8
KINDS = {"float32": TensorProto.FLOAT, "uint8": TensorProto.UINT8}


def contrast_model(
    file: Path,
    *,
    box_px: float = 16.0,
    size_px: tuple[int, int] = (480, 640),
    channels: int = 1,
    kind: str = "float32",
    picked: bool = False,
    gain: float = 2.0,
) -> str:
    """A model that sees something wherever a block of eight by eight pixels is brighter or darker than the conformance suite's ground.

    It takes pictures of one size, (height, width), and gives boxes of one size: laid out (1, 5, N), or (1, N, 6) if `picked`.
    """
    height, width = size_px
    rows, columns = np.divmod(np.arange(height * width // CELL_PX**2), width // CELL_PX)
    x, y = (columns + 0.5) * CELL_PX, (rows + 0.5) * CELL_PX
    half = box_px / 2.0
    fixed = (x - half, y - half, x + half, y + half) if picked else (x, y, box_px + 0 * x, box_px + 0 * x)
    constants = {
        "fixed": np.stack(fixed)[None].astype(np.float32),
        "scale": np.float32(1.0 if kind == "float32" else 1.0 / 255.0),
        "ground": np.float32(GROUND),
        "gain": np.float32(gain),
        "one_row": np.array((1, channels, -1), np.int64),
        "first": np.array((0,), np.int64),
        "second": np.array((1,), np.int64),
        "axis": np.array((1,), np.int64),
        "classes": np.zeros((1, 1, len(x)), np.float32),
    }
    nodes = [
        helper.make_node("Cast", ["picture"], ["as_float"], to=TensorProto.FLOAT),
        helper.make_node("Mul", ["as_float", "scale"], ["light"]),
        helper.make_node("AveragePool", ["light"], ["mean"], kernel_shape=[CELL_PX] * 2, strides=[CELL_PX] * 2),
        helper.make_node("Sub", ["mean", "ground"], ["difference"]),
        helper.make_node("Abs", ["difference"], ["contrast"]),
        helper.make_node("Mul", ["contrast", "gain"], ["strong"]),
        helper.make_node("Reshape", ["strong", "one_row"], ["flat"]),
        helper.make_node("Slice", ["flat", "first", "second", "axis"], ["score"]),
    ]
    if picked:
        nodes += [
            helper.make_node("Concat", ["fixed", "score", "classes"], ["upright"], axis=1),
            helper.make_node("Transpose", ["upright"], ["boxes"], perm=[0, 2, 1]),
        ]
    else:
        nodes.append(helper.make_node("Concat", ["fixed", "score"], ["boxes"], axis=1))
    graph = helper.make_graph(
        nodes,
        "contrast",
        [helper.make_tensor_value_info("picture", KINDS[kind], [1, channels, height, width])],
        [helper.make_tensor_value_info("boxes", TensorProto.FLOAT, None)],
        [numpy_helper.from_array(np.asarray(value), name) for name, value in constants.items()],
    )
    return _saved(graph, file)


def echo_model(file: Path, shape: list[int | str], kind: int = TensorProto.FLOAT) -> str:
    """A model that gives its input back: no detector."""
    graph = helper.make_graph(
        [helper.make_node("Identity", ["picture"], ["again"])],
        "echo",
        [helper.make_tensor_value_info("picture", kind, shape)],
        [helper.make_tensor_value_info("again", kind, None)],
    )
    return _saved(graph, file)


def _saved(graph, file: Path) -> str:
    save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9), file)
    return str(file)
