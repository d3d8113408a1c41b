"""How large the error is: Tables 4 and 5."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from station.biases.sightings import Array
from station.report.figures.static_records import StaticRecord


@dataclass(frozen=True)
class Quality:
    """Of the errors north, east, down, each (3,), metres."""

    mean_m: Array
    sigma_m: Array
    rmse_m: Array
    """Eq. 28."""

    @classmethod
    def of(cls, records: Sequence[StaticRecord]) -> "Quality":
        """Of the samples of all hovers together."""
        error_m = errors_ned_m(records)
        return cls(error_m.mean(axis=0), error_m.std(axis=0), np.sqrt(np.mean(error_m**2, axis=0)))


def errors_ned_m(records: Sequence[StaticRecord]) -> Array:
    """Measured minus true (Eq. 21), all hovers together, (N, 3), metres."""
    return np.concatenate([record.error_ned_m for record in records])
