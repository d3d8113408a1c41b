"""Training the network on crops."""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from station.train_yolo.crops import CROP_PX, Crops
from station.train_yolo.network import CELL_PX, NORMAL_SIDE_PX, PadNetwork, logarithm

SMALLEST_PX, LARGEST_PX = 5.0, 16.5
"""Sides of the markers that a level has to find, pixels of the level: beyond, down to `_FAINT_PX` and up to `_HUGE_PX`, it may."""

_FAINT_PX, _HUGE_PX = 3.5, 23.0
_AT_PX, _NEAR_PX = 5.8, 11.0
"""Places nearer to the centre than the first have to say that they see it, those nearer than the second may."""
_BATCH = 32
WINDOW_PX = 64
"""A network learns as much of a part of a crop in less than half the time."""
_RATE, _WARM_UP = 3e-3, 150
_PLACE_WEIGHT = 1.0
_FOCUS = 2.0
"""Exponent of the focal loss (Lin et al., "Focal loss for dense object detection", 2017)."""
_GAIN_LOG, _OFFSET, _NOISE = 0.35, 0.06, 0.012
_REPORT_STEPS = 100


@dataclass(frozen=True)
class Targets:
    """What the network should have said, each (B, h, w) or (B, 3, h, w)."""

    there: Tensor
    """1 where it should see a marker."""
    counts: Tensor
    """1 where that matters."""
    place: Tensor
    """dx and dy in cells and the logarithm of the side."""


def trained(crops: Crops, seed: int, steps: int) -> PadNetwork:
    """A network that has seen so many batches, on one thread: the same seed and crops give the same network on the same machine."""
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    torch.use_deterministic_algorithms(True)
    network = PadNetwork()
    optimiser = torch.optim.AdamW(network.parameters(), lr=_RATE, weight_decay=1e-4)
    plan = torch.optim.lr_scheduler.LambdaLR(optimiser, lambda step: _rate(step, steps))
    began_s, recent = time.monotonic(), []
    for step, (pictures, markers) in enumerate(_batches(crops, seed, steps), start=1):
        loss = loss_of(network(logarithm(pictures)), targets_of(markers))
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 5.0)
        optimiser.step()
        plan.step()
        recent.append(float(loss.detach()))
        if step % _REPORT_STEPS == 0 or step == steps:
            print(f"step {step}: loss {np.mean(recent):.4f}, {time.monotonic() - began_s:.0f} s", flush=True)
            recent.clear()
    network.eval()
    return network


def _rate(step: int, steps: int) -> float:
    return min((step + 1) / _WARM_UP, 1.0) * 0.5 * (1.0 + math.cos(math.pi * step / steps))


def targets_of(markers: Tensor) -> Targets:
    """Of markers (B, 3): x and y of the centre and side in pixels of the window, NaN where there is none."""
    x, y, side = (markers[:, index].reshape(-1, 1, 1) for index in range(3))
    along = torch.arange(WINDOW_PX // CELL_PX, dtype=torch.float32) * CELL_PX
    dx, dy = x - along.reshape(1, 1, -1), y - along.reshape(1, -1, 1)
    distance = torch.hypot(dx, dy)
    fits, may = _between(side, SMALLEST_PX, LARGEST_PX), _between(side, _FAINT_PX, _HUGE_PX)
    there = fits & (distance < _AT_PX)
    ignored = ~there & may & (distance < torch.clamp(side * 0.7, min=_NEAR_PX))
    log_side = torch.log(side / NORMAL_SIDE_PX).expand_as(distance)
    place = torch.stack(((dx / CELL_PX).expand_as(distance), (dy / CELL_PX).expand_as(distance), log_side), dim=1)
    return Targets(there.float(), (~ignored).float(), torch.nan_to_num(place))


def loss_of(judged: Tensor, targets: Targets) -> Tensor:
    """Focal loss of the scores and mean absolute error of place and side, a marker's share."""
    chance = torch.sigmoid(judged[:, 0])
    right = torch.where(targets.there > 0, chance, 1.0 - chance)
    entropy = torch.nn.functional.binary_cross_entropy_with_logits(judged[:, 0], targets.there, reduction="none")
    scores = (targets.counts * (1.0 - right) ** _FOCUS * entropy).sum()
    places = (targets.there * (judged[:, 1:] - targets.place).abs().sum(dim=1)).sum()
    loss: Tensor = (scores + _PLACE_WEIGHT * places) / targets.there.sum().clamp(min=1.0)
    return loss


def _between(side: Tensor, least: float, largest: float) -> Tensor:
    return (side > least) & (side < largest)


def _batches(crops: Crops, seed: int, steps: int) -> Iterator[tuple[Tensor, Tensor]]:
    """Turned, mirrored, in other light."""
    draw = np.random.default_rng(seed)
    order = np.empty(0, int)
    for _ in range(steps):
        if len(order) < _BATCH:
            order = np.concatenate((order, draw.permutation(len(crops.pictures))))
        chosen, order = order[:_BATCH], order[_BATCH:]
        windows = [_window(crops.pictures[index], crops.markers[index], draw) for index in chosen.tolist()]
        pictures = np.array([picture for picture, _ in windows], np.float32) / 255.0
        pictures, markers = _turned(pictures, np.array([marker for _, marker in windows], np.float32), draw)
        yield torch.from_numpy(_relit(pictures, draw)).unsqueeze(1), torch.from_numpy(markers)


def _window(
    picture: NDArray[np.uint8], marker: NDArray[np.float32], draw: np.random.Generator
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """A part of a crop, with the marker's centre in it if there is one."""
    room = CROP_PX - WINDOW_PX
    middle = marker[:2] if np.isfinite(marker[0]) else np.full(2, CROP_PX / 2.0)
    low = np.clip(np.ceil(middle - WINDOW_PX + 1.0), 0, room).astype(int)
    high = np.clip(np.floor(middle), 0, room).astype(int)
    left, top = (int(draw.integers(first, last + 1)) for first, last in zip(low, high, strict=True))
    part = picture[top : top + WINDOW_PX, left : left + WINDOW_PX]
    return part, marker - np.array((left, top, 0.0), np.float32)


def _turned(
    pictures: NDArray[np.float32], markers: NDArray[np.float32], draw: np.random.Generator
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    last = WINDOW_PX - 1.0
    if draw.random() < 0.5:
        pictures, markers[:, :2] = pictures.transpose(0, 2, 1), markers[:, 1::-1].copy()
    if draw.random() < 0.5:
        pictures, markers[:, 0] = pictures[:, :, ::-1], last - markers[:, 0]
    if draw.random() < 0.5:
        pictures, markers[:, 1] = pictures[:, ::-1], last - markers[:, 1]
    return pictures, markers


def _relit(pictures: NDArray[np.float32], draw: np.random.Generator) -> NDArray[np.float32]:
    count = (len(pictures), 1, 1)
    gain = np.exp(draw.normal(0.0, _GAIN_LOG, count)).astype(np.float32)
    offset = draw.normal(0.0, _OFFSET, count).astype(np.float32)
    noise = draw.standard_normal(pictures.shape, np.float32) * draw.normal(0.0, _NOISE, count).astype(np.float32)
    return np.asarray(np.clip(pictures * gain + offset + noise, 0.0, 1.0), np.float32)
