"""Writing a trained network as an ONNX model."""

from pathlib import Path

import torch

from station.train_yolo.network import PadModel, PadNetwork

_OPSET = 17


def exported(network: PadNetwork, file: Path) -> None:
    """Write it for pictures (1, 1, H, W), float32 from 0 to 1, of any size."""
    sizes = {"picture": {2: "height", 3: "width"}, "boxes": {2: "places"}}
    torch.onnx.export(
        PadModel(network).eval(),
        (torch.zeros(1, 1, 480, 640),),
        str(file),
        dynamo=False,  # the newer exporter needs two packages more
        opset_version=_OPSET,
        input_names=["picture"],
        output_names=["boxes"],
        dynamic_axes=sizes,
    )
