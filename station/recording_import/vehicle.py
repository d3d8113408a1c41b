"""The vehicle's side of an import, from whatever kind of log."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from alight.runtime.clock import NS_PER_S
from schemas import topics
from schemas.settings import Settings
from station.recording_import.euler_attitude import with_quaternions
from station.recording_import.heard import Heard
from station.recording_import.mavlink_vehicle import mavlink_vehicle
from station.recording_import.source_error import SourceError
from station.recording_import.tlog import read_tlog
from station.recording_import.ulog_vehicle import ulog_vehicle


@dataclass(frozen=True)
class Vehicle:
    """All that a log says of the vehicle."""

    log: Path
    heard: Sequence[Heard]
    """States, status and gimbal, in order of arrival."""
    first_ns: int
    """The first pose, UTC ns."""
    last_ns: int
    """The last pose, UTC ns."""
    poses: int
    """How many there are."""
    dated: bool
    """Whether times are UTC; otherwise they count from the autopilot's boot."""


def vehicle_of(log: Path, settings: Settings) -> Vehicle:
    """Read a log, of the kind that its name ends in.

    Raises:
        SourceError: If it cannot be read, is of another kind, or holds no pose.
    """
    dated = True
    if log.suffix.lower() == ".tlog":
        heard = list(mavlink_vehicle(with_quaternions(list(read_tlog(log))), settings))
    elif log.suffix.lower() == ".ulg":
        source = ulog_vehicle(log, settings)
        heard, dated = list(source.heard), source.dated
    else:
        raise SourceError(f"{log}: is neither .ulg (PX4) nor .tlog (MAVLink telemetry); dataflash logs are not read")
    stamps_ns = [one.message.stamp_ns for one in heard if one.topic is topics.VEHICLE_STATE]
    if not stamps_ns:
        raise SourceError(
            f"{log}: holds no pose: it needs GLOBAL_POSITION_INT and ATTITUDE_QUATERNION (or ATTITUDE) of an autopilot with a HEARTBEAT"
        )
    return Vehicle(log, heard, stamps_ns[0], stamps_ns[-1], len(stamps_ns), dated)


def check_overlap(first_ns: int, last_ns: int | None, vehicle: Vehicle) -> None:
    """Whether a video can belong to a log.

    Args:
        first_ns: Its first frame, UTC ns.
        last_ns: Its last frame; None if that is not known yet.
        vehicle: The log.

    Raises:
        SourceError: If no frame lies in the log's time.
    """
    if first_ns > vehicle.last_ns or (last_ns is not None and last_ns < vehicle.first_ns):
        ends = "" if last_ns is None else f" to {moment(last_ns, vehicle.dated)}"
        raise SourceError(
            f"the video ({moment(first_ns, vehicle.dated)}{ends}) and the log ({moment(vehicle.first_ns, vehicle.dated)} to "
            f"{moment(vehicle.last_ns, vehicle.dated)}) have no time in common: correct --video-start, --stamps or --offset"
        )


def moment(at_ns: int, dated: bool) -> str:
    """A time as a person reads it: UTC, or seconds since the autopilot's boot."""
    if not dated:
        return f"{at_ns / NS_PER_S:.3f} s after boot"
    whole_s, rest_ns = divmod(at_ns, NS_PER_S)
    return f"{datetime.fromtimestamp(whole_s, UTC):%Y-%m-%dT%H:%M:%S}.{rest_ns // 1_000_000:03d}Z"
