"""One flight of a campaign, as it is handed to whoever flies it."""

from typing import Any

from pydantic import Field

from schemas.message import Vector3
from schemas.settings import Section, Settings


class FlightTask(Section):
    """Everything that decides how a flight goes."""

    index: int = Field(ge=0)
    """Its number in the campaign."""
    drawn: dict[str, Any]
    """What it has of each factor, by key."""
    settings: Settings
    start_ned_m: Vector3
    """Where the landing starts, north, east, down of home, metres."""
    flight_timeout_s: float
    """Given up after so many virtual seconds."""
    pad_radius_m: float
    """What counts as on the pad, metres."""
    record_in: str = ""
    """Folder for a recording; empty for none."""
