"""Writes the report of a flight."""

from importlib.util import find_spec
from pathlib import Path

from station.flight_record import FlightRecord
from station.metrics.summary import FlightSummary
from station.report.error import ReportError


def check_drawing() -> None:
    """See that pictures can be drawn.

    Raises:
        ReportError: If matplotlib is missing.
    """
    if find_spec("matplotlib") is None:
        raise ReportError("the report draws with matplotlib, which is missing: pip install 'alight[report]'")


def write_report(record: FlightRecord, summary: FlightSummary, path: Path) -> None:
    """Write one self-contained HTML file; the same flight always yields the same bytes.

    Raises:
        ReportError: If matplotlib is missing or the file cannot be written.
    """
    check_drawing()
    from station.report.page import page  # noqa: PLC0415 - loads matplotlib, which is an extra

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(page(record, summary), encoding="utf-8")
    except OSError as error:
        raise ReportError(f"{path} cannot be written ({error.strerror}): choose another file with --out") from error
