"""How the corrections do where they were not fitted: other heights, headings and tilts."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from station.biases.corrected_hover import with_true_attitude
from station.biases.quality import Quality
from station.biases.recorded_hover import RecordedHover
from station.biases.sightings import Array
from station.biases.study import BY_AUTOPILOT, VARIANTS, ByPrint, Study
from station.experiment.hover_plan import HoverPlace
from station.report.figures.static_records import StaticRecord

LIMIT_M, LIMIT_OF_RANGE = 0.02, 0.001
_TABLES = {
    "as flown, with the autopilot's attitude": "rmse_m",
    "as flown, with the heading by the pad's print (geolocator.heading), its azimuth as fitted": "heading_by_print_m",
    "as flown, with heading, roll and pitch by the pad's print (geolocator.heading, .tilt), its lie as fitted": "attitude_by_print_m",
    "with the true attitude": "own_m",
}


@dataclass(frozen=True)
class Condition:
    """One kind of hover that is not in the fit."""

    label: str
    range_m: float
    """From the vehicle to the pad, mean."""
    rmse_m: dict[str, Array]
    """North, east, down by `raw` and variant."""
    heading_by_print_m: dict[str, Array]
    """The same with the heading by the pad's print, whose azimuth the fit found."""
    attitude_by_print_m: dict[str, Array]
    """The same with roll and pitch, too."""
    own_m: dict[str, Array]
    """The same with the autopilot's attitude error taken out: the correction's own."""

    @property
    def limit_m(self) -> float:
        """What `extrinsic` should keep to, north and east."""
        return LIMIT_M + LIMIT_OF_RANGE * self.range_m


def generalise(study: Study, places: Sequence[HoverPlace], hovers: Sequence[RecordedHover]) -> list[Condition]:
    """Apply the study's corrections to hovers elsewhere.

    Args:
        study: The fits.
        places: What was asked of each hover.
        hovers: In the same order.
    """
    labels = dict.fromkeys(place.label for place in places)
    return [
        _condition(study, label, [hover for hover, place in zip(hovers, places, strict=True) if place.label == label])
        for label in labels
    ]


def _condition(study: Study, label: str, hovers: Sequence[RecordedHover]) -> Condition:
    records: dict[str, list[StaticRecord]] = {"raw": [hover.static for hover in hovers]}
    variants = VARIANTS if study.by_autopilot is None else (*VARIANTS, BY_AUTOPILOT)
    records |= {variant: [study.relocated(hover, variant) for hover in hovers] for variant in variants}

    def by_print(what: ByPrint) -> dict[str, Array]:
        located = {name: [study.relocated(hover, name, what) for hover in hovers] for name in variants}
        return {name: Quality.of(of_name).rmse_m for name, of_name in ({"raw": records["raw"]} | located).items()}

    own = {
        name: [with_true_attitude(hover, record) for hover, record in zip(hovers, of_name, strict=True)]
        for name, of_name in records.items()
    }
    return Condition(
        label,
        float(np.mean([np.linalg.norm(hover.static.true_ned_m) for hover in hovers])),
        {name: Quality.of(of_name).rmse_m for name, of_name in records.items()},
        by_print("heading"),
        by_print("attitude"),
        {name: Quality.of(of_name).rmse_m for name, of_name in own.items()},
    )


def generalisation_lines(conditions: Sequence[Condition]) -> Iterator[str]:
    """The table, for a terminal."""
    columns = {"raw": "raw", "mean": "cylindrical", "extrinsic": "extrinsic", BY_AUTOPILOT: "by autopilot"}
    names = [name for name in columns if all(name in one.rmse_m for one in conditions)]
    yield "Not in the fit: RMSE north / east / down, cm; cylindrical is the variant `mean`; the verdict is of extrinsic"
    if BY_AUTOPILOT in names:
        yield "by autopilot: extrinsic, fitted without the reference's attitude"
    head = f"{'':<18}{'range':>7}" + "".join(f"{columns[name]:>22}" for name in names)
    for title, kept in _TABLES.items():
        yield f"\n{title}\n{head}   limit N, E"
        for one in conditions:
            table: dict[str, Array] = getattr(one, kept)
            cells = "".join(" / ".join(f"{100 * value:.1f}" for value in table[name]).rjust(22) for name in names)
            verdict = "met" if table["extrinsic"][:2].max() <= one.limit_m else "NOT met"
            yield f"{one.label:<18}{one.range_m:>5.1f} m{cells}{100 * one.limit_m:>9.1f} {verdict}"
