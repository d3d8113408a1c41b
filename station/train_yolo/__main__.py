"""`python -m station.train_yolo --out pad.onnx`: renders frames, trains the network and exports it; the same seed gives the same model on the same machine."""

import argparse
import sys
from pathlib import Path

from station.bench.detection_scene import one_thread
from station.train_yolo.crops import cached_crops

SEED, STUDIOS, SHOTS, CLUTTER, STEPS = 4, 10, 240, 40, 2400
"""Those of the shipped model."""


def main() -> int:
    """Train and say how good it came out."""
    parser = argparse.ArgumentParser(prog="python -m station.train_yolo", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="where to put the model")
    parser.add_argument("--cache", type=Path, required=True, metavar="DIR", help="where rendered pictures are kept")
    parser.add_argument(
        "--seed", type=int, default=SEED, metavar="N", help="of everything random (default: %(default)s)"
    )
    parser.add_argument("--studios", type=int, default=STUDIOS, metavar="N", help="sets of 16 cameras and markers")
    parser.add_argument("--steps", type=int, default=STEPS, metavar="N", help="batches to learn from")
    options = parser.parse_args()
    try:
        from station.train_yolo.export import exported  # noqa: PLC0415 - needs the extra `train`
        from station.train_yolo.training import trained  # noqa: PLC0415
        from station.train_yolo.validation import print_validation  # noqa: PLC0415 - needs the extra `yolo`
    except ModuleNotFoundError as error:
        print(f"training needs {error.name}: pip install 'alight[train,yolo]'", file=sys.stderr)
        return 2
    one_thread()
    crops = cached_crops(options.seed, options.studios, SHOTS, CLUTTER, options.cache)
    network = trained(crops, options.seed, options.steps)
    exported(network, options.out)
    print_validation(options.out, shots=64, blank=64)
    return 0


if __name__ == "__main__":
    sys.exit(main())
