"""The results as Parquet: the same bytes for the same campaign, however often it was interrupted and whoever flew it."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from station.campaign.ledger import Timing
from station.campaign.row import MEASURED, Row

RESULTS, TIMINGS = "results.parquet", "timings.parquet"


class TableError(RuntimeError):
    """No table can be written: one line with the remedy."""


def check_parquet() -> None:
    """See before the first flight that the tables can be written after the last one.

    Raises:
        TableError: If the library is missing.
    """
    try:
        import pyarrow.parquet  # noqa: F401, PLC0415 - an extra
    except ImportError:
        raise TableError("Parquet is not installed: pip install 'alight[campaign]'") from None


def write_results(rows: Sequence[Row], out: Path, digest: str) -> Path:
    """Write `results.parquet`: one line a flight, ordered by index, without anything that depends on the machine.

    Args:
        rows: In any order, each index once.
        out: The folder.
        digest: The campaign's, kept in the file's metadata.
    """
    ordered = sorted(rows, key=lambda row: int(row["index"]))
    names = dict.fromkeys(name for row in ordered for name in row)
    columns = {name: [row.get(name) for row in ordered] for name in names}
    return _write(columns, out / RESULTS, {"alight_campaign": digest})


def write_timings(timings: Mapping[int, Timing], out: Path) -> Path:
    """Write `timings.parquet`: what each flight cost, and who flew it."""
    ordered = sorted(timings.items())
    columns: dict[str, list[Any]] = {
        "index": [index for index, _ in ordered],
        "took_s": [timing.took_s for _, timing in ordered],
        "by": [timing.by for _, timing in ordered],
    }
    return _write(columns, out / TIMINGS, {})


def read_results(path: Path) -> list[Row]:
    """The rows of a `results.parquet`."""
    import pyarrow.parquet  # noqa: PLC0415

    rows: list[Row] = pyarrow.parquet.read_table(path).to_pylist()
    return rows


def _write(columns: Mapping[str, list[Any]], path: Path, metadata: Mapping[str, str]) -> Path:
    import pyarrow  # noqa: PLC0415
    import pyarrow.parquet  # noqa: PLC0415

    arrays = {name: _array(name, values) for name, values in columns.items()}
    table = pyarrow.table(arrays).replace_schema_metadata(dict(metadata))
    fresh = path.with_suffix(".new")
    pyarrow.parquet.write_table(table, fresh, compression="zstd")
    fresh.replace(path)
    return path


def _array(name: str, values: list[Any]) -> Any:
    """A column: by the kind that it is known to have, or by its values; what has no common kind is written as JSON."""
    import pyarrow  # noqa: PLC0415

    kind = MEASURED.get(name) or _common_kind(values)
    types = {bool: pyarrow.bool_(), int: pyarrow.int64(), float: pyarrow.float64(), str: pyarrow.string()}
    if kind is None:
        return pyarrow.array([None if value is None else json.dumps(value) for value in values], pyarrow.string())
    return pyarrow.array([None if value is None else kind(value) for value in values], types[kind])


def _common_kind(values: Sequence[Any]) -> type | None:
    kinds = {type(value) for value in values if value is not None}
    if kinds == {int, float}:
        return float
    only = next(iter(kinds)) if len(kinds) == 1 else None
    return only if only in (bool, int, float, str) else None
