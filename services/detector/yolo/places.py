"""Places from a model's boxes."""

import math
from collections.abc import Mapping

from schemas.settings.detector import Yolo
from services.detector.aided.places import Place
from services.detector.detector import Tally, View
from services.detector.yolo.model import Box, OnnxModel

_SIZE_STEP = 1.4
"""Between two sizes that are tried; the search at a place finds markers a fifth larger or smaller."""
_APART_SIDES = 0.5
_REACH_SIDES, _LEAST_REACH_PX = 0.25, 2.0


class ModelPlaces:
    """The likeliest boxes of a frame, one for each thing."""

    name = "yolo"

    def __init__(self, settings: Yolo) -> None:
        """Load the model.

        Raises:
            ModelError: If it cannot be used.
        """
        self._settings = settings
        self._model = OnnxModel(settings)
        self._tally = Tally({"model_runs": 0, "places_proposed": 0})

    def places(self, view: View) -> list[Place]:
        """Best first, each in as many sizes as a box may mean."""
        self._tally.add("model_runs")
        settings = self._settings
        boxes = distinct(self._model.boxes(view.picture, settings.least_score), settings.most_boxes)
        places = [place for box in boxes for place in self._of(box)]
        self._tally.counts["places_proposed"] += len(places)
        return places

    def counters(self) -> Mapping[str, int]:
        """How often the model ran, and how much it proposed."""
        return self._tally.counts

    def _of(self, box: Box) -> list[Place]:
        size_px = math.sqrt(max(box.width_px * box.height_px, 0.0))
        least, most = self._settings.least_sides_a_box, self._settings.most_sides_a_box
        count = max(math.ceil(math.log(most / least) / math.log(_SIZE_STEP)), 1)
        middle = math.sqrt(least * most)
        sides_px = [size_px / middle * _SIZE_STEP ** (number - (count - 1) / 2.0) for number in range(count)]
        reach_px = max(_REACH_SIDES * size_px, _LEAST_REACH_PX)
        return [Place(box.x_px, box.y_px, side_px, reach_px) for side_px in sides_px if side_px > 1.0]


def distinct(boxes: list[Box], most: int) -> list[Box]:
    """The best ones that do not lie over a better one, best first; the same whichever order they come in."""
    kept: list[Box] = []
    for box in sorted(boxes, key=lambda each: (-each.score, each.y_px, each.x_px)):
        if all(_apart(box, better) for better in kept):
            kept.append(box)
            if len(kept) == most:
                break
    return kept


def _apart(box: Box, better: Box) -> bool:
    away_px = max(abs(box.x_px - better.x_px), abs(box.y_px - better.y_px))
    return away_px > _APART_SIDES * max(min(better.width_px, better.height_px), 1.0)
