"""The one table of what flows between the processes.

Subscriptions, publications, recording, staleness checks, JSON Schema export and the documentation's diagram all follow
from it. To add a topic, add a row; to let a service read one, add its name to the row's readers.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Generic, TypeVar

from schemas.calibration import CameraCalibration
from schemas.detection import Detection
from schemas.estimate import PadEstimate
from schemas.fix import PadFix
from schemas.frame import FrameHeader
from schemas.fusion import Fusion
from schemas.health import Health
from schemas.journal import Journal
from schemas.message import Message
from schemas.mission import MissionReply, MissionRequest, MissionStatus
from schemas.setpoint import Setpoint
from schemas.truth import GroundTruth
from schemas.vehicle import GimbalState, VehicleState, VehicleStatus

M = TypeVar("M", bound=Message)
M_co = TypeVar("M_co", bound=Message, covariant=True)


class Delivery(StrEnum):
    """How a topic is delivered. There is no per-call tuning."""

    STREAM = "stream"
    """The newest wins and any may be dropped: frames."""
    STATE = "state"
    """Reliable and in order; who joins late gets the newest: states, estimates, status."""
    EVENT = "event"
    """Reliable and never dropped: requests and replies."""


@dataclass(frozen=True, eq=False)
class Topic(Generic[M_co]):
    """One row: where, what, how, how often, from whom to whom."""

    name: str
    """Last part of the key `alight/<vehicle>/<name>`; for `per_service` topics the service's name follows."""
    message: type[M_co]
    delivery: Delivery
    nominal_hz: float
    """Usual rate; 0 for what comes when it comes."""
    stale_after_s: float | None
    """Silence longer than this is reported by every reader; None for what comes when it comes."""
    max_age_s: float | None
    """A message that speaks of a time longer ago than this on arrival is refused; None where age does not matter."""
    publishers: frozenset[str]
    readers: frozenset[str]
    has_pixels: bool = False
    """Whether raw pixels travel as the payload and the message as the attachment beside them."""
    per_service: bool = False
    """Whether each publisher has a key of its own below this name."""

    def key(self, vehicle: str, service: str = "*") -> str:
        """The Zenoh key expression for one vehicle."""
        tail = f"/{service}" if self.per_service else ""
        return f"alight/{vehicle}/{self.name}{tail}"


MISSION_SERVICES = frozenset({"camera", "detector", "geolocator", "filter", "commander"})
"""The five that land. None but the camera's renderer may know the ground truth."""

SERVICES = MISSION_SERVICES | {"simulator", "recorder"}


def _row(
    name: str,
    message: type[M],
    delivery: Delivery,
    publishers: str,
    readers: str,
    *,
    hz: float = 0.0,
    stale_after_s: float | None = None,
    max_age_s: float | None = 5.0,
    has_pixels: bool = False,
    per_service: bool = False,
) -> Topic[M]:
    return Topic(
        name=name,
        message=message,
        delivery=delivery,
        nominal_hz=hz,
        stale_after_s=stale_after_s,
        max_age_s=max_age_s,
        publishers=frozenset(publishers.split()),
        readers=frozenset(readers.split()),
        has_pixels=has_pixels,
        per_service=per_service,
    )


# fmt: off
#                    name                    message            delivery         published by   read by
FRAME = _row(        "camera/frame",         FrameHeader,       Delivery.STREAM, "camera",      "detector recorder station",
                     hz=30, stale_after_s=0.5, has_pixels=True)
CALIBRATION = _row(  "camera/calibration",   CameraCalibration, Delivery.STATE,  "camera",      "detector geolocator recorder",
                     hz=1, stale_after_s=5, max_age_s=None)
DETECTION = _row(    "detector/detection",   Detection,         Delivery.STATE,  "detector",    "geolocator recorder station",
                     hz=30, stale_after_s=0.5)
VEHICLE_STATE = _row("vehicle/state",        VehicleState,      Delivery.STATE,  "commander",   "geolocator detector filter recorder",
                     hz=50, stale_after_s=0.5)
VEHICLE_STATUS = _row("vehicle/status",      VehicleStatus,     Delivery.STATE,  "commander",   "detector recorder station",
                     hz=5, stale_after_s=2)
GIMBAL_STATE = _row( "vehicle/gimbal",       GimbalState,       Delivery.STATE,  "commander",   "geolocator detector recorder",
                     hz=10, stale_after_s=2)
PAD_FIX = _row(      "geolocator/fix",       PadFix,            Delivery.STATE,  "geolocator",  "filter recorder station",
                     hz=30, stale_after_s=0.5)
PAD_ESTIMATE = _row( "filter/estimate",      PadEstimate,       Delivery.STATE,  "filter",      "commander detector recorder station",
                     hz=10, stale_after_s=1)
FUSION = _row(       "filter/fusion",        Fusion,            Delivery.STATE,  "filter",      "recorder station",
                     hz=30)
SETPOINT = _row(     "commander/setpoint",   Setpoint,          Delivery.STATE,  "commander",   "recorder")
MISSION_STATUS = _row("commander/mission",   MissionStatus,     Delivery.STATE,  "commander",   "recorder station",
                     hz=5, stale_after_s=2)
REQUEST = _row(      "commander/request",    MissionRequest,    Delivery.EVENT,  "station",     "commander recorder")
REPLY = _row(        "commander/reply",      MissionReply,      Delivery.EVENT,  "commander",   "station recorder")
HEALTH = _row(       "health",               Health,            Delivery.STATE,  " ".join(sorted(SERVICES | {"station"})), "recorder station",
                     hz=1, stale_after_s=3, per_service=True)
JOURNAL = _row(      "journal",              Journal,           Delivery.EVENT,  "detector geolocator filter commander", "recorder",
                     hz=4, stale_after_s=2, per_service=True)
GROUND_TRUTH = _row( "truth",                GroundTruth,       Delivery.STATE,  "simulator",   "camera recorder station",
                     hz=60, stale_after_s=1)
# fmt: on

TOPICS: tuple[Topic[Any], ...] = tuple(row for row in dict(globals()).values() if isinstance(row, Topic))
BY_NAME: dict[str, Topic[Any]] = {topic.name: topic for topic in TOPICS}


def read_by(service: str) -> tuple[Topic[Any], ...]:
    """The topics that a service may subscribe to."""
    return tuple(topic for topic in TOPICS if service in topic.readers)


def published_by(service: str) -> tuple[Topic[Any], ...]:
    """The topics that a service may publish."""
    return tuple(topic for topic in TOPICS if service in topic.publishers)
