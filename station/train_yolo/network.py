"""The network: five small convolutions, laid over the picture at four scales."""

import torch
from torch import Tensor, nn

from station.train_yolo.crops import LEVELS

CELL_PX = 8
"""Distance of neighbouring places that the network judges, pixels of its level."""
NORMAL_SIDE_PX = 9.0
"""Side of a marker for which it says 0; pixels of its level."""

_DARKEST, _MIDDLE = 0.06, 0.5
_CHANNELS = (8, 16, 48)
_RARE = -4.0
"""Where the scores begin: places with a marker are few."""


class PadNetwork(nn.Module):
    """Looks at one scale. From (B, 1, h, w), grey levels from 0 to 1, to (B, 4, h / 8, w / 8): score before the logistic function, dx and dy in cells, log of the side."""

    def __init__(self) -> None:
        super().__init__()
        fine, middle, coarse = _CHANNELS
        self.layers = nn.Sequential(
            nn.Conv2d(1, fine, 5, 2, 2),
            nn.ReLU(),
            nn.Conv2d(fine, middle, 3, 2, 1),
            nn.ReLU(),
            nn.Conv2d(middle, coarse, 3, 2, 1),
            nn.ReLU(),
            nn.Conv2d(coarse, coarse, 3, 1, 1),
            nn.ReLU(),
            nn.Conv2d(coarse, coarse, 3, 1, 1),
            nn.ReLU(),
            nn.Conv2d(coarse, 4, 1),
        )
        with torch.no_grad():
            self.layers[-1].bias[0] = _RARE

    def forward(self, light: Tensor) -> Tensor:
        """Of the logarithm of the brightness, in which a shadow's edge is a step and no factor."""
        judged: Tensor = self.layers(light)
        return judged


def logarithm(picture: Tensor) -> Tensor:
    """Of grey levels from 0 to 1; middle grey is 0."""
    return torch.log((picture + _DARKEST) / _MIDDLE)


class PadModel(nn.Module):
    """What is exported: from (1, 1, H, W) to boxes (1, 5, N), laid out as Ultralytics' detectors lay them out: x, y, width, height and score."""

    def __init__(self, network: PadNetwork) -> None:
        super().__init__()
        self._network = network

    def forward(self, picture: Tensor) -> Tensor:
        """Boxes of all scales, in pixels of the picture, the first one's upper left corner at (0, 0)."""
        boxes = []
        for level in range(LEVELS):
            boxes.append(_boxes(self._network(logarithm(picture)), float(1 << level)))
            picture = nn.functional.avg_pool2d(picture, 2)
        return torch.cat(boxes, dim=2)


def _boxes(judged: Tensor, scale: float) -> Tensor:
    score, dx, dy, log_side = judged.split(1, dim=1)
    # The centre of the first place is that of the first pixel.
    columns = torch.arange(judged.shape[3], dtype=torch.float32).reshape(1, 1, 1, -1)
    rows = torch.arange(judged.shape[2], dtype=torch.float32).reshape(1, 1, -1, 1)
    x = ((columns + dx) * CELL_PX + 0.5) * scale
    y = ((rows + dy) * CELL_PX + 0.5) * scale
    side = torch.exp(log_side) * (NORMAL_SIDE_PX * scale)
    return torch.cat((x, y, side, side, torch.sigmoid(score)), dim=1).flatten(2)
