"""Landings for the figures, from recordings."""

from schemas import topics
from station.flight_record import FlightRecord
from station.metrics.summary import FlightSummary
from station.report.figures.landings import LandingTrack
from station.report.flight_path import flight_paths, within


def landing_track(record: FlightRecord, summary: FlightSummary) -> LandingTrack | None:
    """The landing of a flight; None if the descent never began."""
    paths = flight_paths(record, summary)
    if summary.landing is None or not paths.navigated:
        return None
    part_s = (0.0, paths.shown_s[1])
    flown, asked = within(paths.navigated, part_s), within(paths.setpoints, part_s)
    return LandingTrack(mode_of(record), flown.t_s, flown.ned_m, asked.t_s, asked.ned_m)


def mode_of(record: FlightRecord) -> str:
    """How a flight was flown, in the paper's terms: correction, filter, and how it comes down."""
    correction = record.setting("geolocator", "correction", {}).get("method", "none")
    corrected = {"none": "without correction"}.get(correction, f"{correction} correction")
    methods = sorted({estimate.method for estimate in record.messages(topics.PAD_ESTIMATE)})
    statuses = record.messages(topics.MISSION_STATUS)
    guidance = statuses[-1].guidance if statuses else "unknown guidance"
    if guidance == "reposition":
        guidance = str(record.setting("commander", "reposition", {}).get("law", "exponential")) + " law"
    return ", ".join([corrected, *(f"{method} filter" for method in methods), guidance])
