"""What an import says of what it found."""

from collections.abc import Iterator, Mapping, Sized
from itertools import pairwise

from alight.runtime.clock import seconds
from schemas import topics
from schemas.settings import Settings
from station.recording_import.vehicle import Vehicle, moment
from station.recording_import.video import Film


def about_vehicle(vehicle: Vehicle, settings: Settings) -> Iterator[str]:
    """Lines on the log: how long, how many poses, and what will trouble a replay."""
    span_s = seconds(vehicle.last_ns - vehicle.first_ns)
    yield (
        f"log        {moment(vehicle.first_ns, vehicle.dated)} to {moment(vehicle.last_ns, vehicle.dated)}: {span_s:.1f} s, "
        f"{vehicle.poses} poses"
    )
    if not vehicle.dated:
        yield "note       the log has no GPS time: its times, and --video-start, count from the autopilot's boot"
    limit_s = settings.geolocator.lookup.max_gap_s
    wide = _wider_gaps(vehicle, limit_s)
    if wide > 0.02:
        yield (
            f"note       {wide:.0%} of the time lies in gaps between poses wider than geolocator.lookup.max_gap_s = {limit_s:g} s, "
            "in which nothing is located: log poses more often, or import with --set geolocator.lookup.max_gap_s=S"
        )


def about_film(film: Film | None, counts: Mapping[str, int]) -> Iterator[str]:
    """Lines on the video: whether pictures and stamps were as many."""
    if film is None:
        yield "note       no --video: the recording holds the vehicle alone"
        return
    frames = counts.get(topics.FRAME.name, 0)
    if isinstance(film.stamps_ns, Sized) and len(film.stamps_ns) > frames:
        yield f"note       {len(film.stamps_ns)} stamps, but {frames} pictures: does each stamp belong to its picture?"


def _wider_gaps(vehicle: Vehicle, limit_s: float) -> float:
    """Part of the log's time that lies in gaps between poses wider than this, 0 to 1."""
    stamps_ns = [one.message.stamp_ns for one in vehicle.heard if one.topic is topics.VEHICLE_STATE]
    gaps_s = [seconds(after - before) for before, after in pairwise(stamps_ns)]
    total_s = sum(gaps_s)
    return sum(gap_s for gap_s in gaps_s if gap_s > limit_s) / total_s if total_s > 0.0 else 0.0
