"""The bases of every message, and the small types that messages are made of.

A message is frozen, refuses unknown fields and refuses NaN and infinity, so that what was validated once stays valid.
The docstring under a field becomes its description in the exported JSON Schema: it gives unit and frame.
"""

from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field

SCHEMA_VERSION = 3
"""Version of all messages together. It travels in the Zenoh encoding; a message of another version is refused."""

Nanoseconds = Annotated[int, Field(ge=0, lt=2**63)]
"""A point in time: integer nanoseconds since the Unix epoch, UTC."""

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
"""Unit quaternion, order w, x, y, z. `q_a_b` takes coordinates in frame b to frame a."""

Matrix3 = Annotated[tuple[float, ...], Field(min_length=9, max_length=9)]
"""3x3 matrix, row by row."""

Matrix4 = Annotated[tuple[float, ...], Field(min_length=16, max_length=16)]
"""4x4 matrix, row by row."""

Matrix6 = Annotated[tuple[float, ...], Field(min_length=36, max_length=36)]
"""6x6 matrix, row by row."""

ShortText = Annotated[str, Field(max_length=500)]


class Part(BaseModel):
    """A piece of a message: frozen, finite, closed to unknown fields."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True)


class Hop(Part):
    """What one service did with a datum on its way from the light to the setpoint."""

    service: ShortText
    """Name of the service."""
    received_at_ns: Nanoseconds
    """When the message that caused this one reached the process, UTC ns on that process's host."""
    handled_at_ns: Nanoseconds
    """When the service took it up (later than received: it waited in a queue), UTC ns."""
    published_at_ns: Nanoseconds
    """When the result left the service, UTC ns. What a simulated sensor keeps back until its time carries that time, though it leaves some
    hundredths of a millisecond later."""


class Message(Part):
    """Anything that travels on a topic."""

    @property
    def stamp_ns(self) -> int:
        """The time this message speaks of, UTC ns. Order and age on a topic are judged by it."""
        raise NotImplementedError


class Stamped(Message):
    """A message that speaks of the time `at_ns`."""

    at_ns: Nanoseconds
    """The time this message speaks of, UTC ns."""

    @property
    def stamp_ns(self) -> int:
        """See `Message.stamp_ns`."""
        return self.at_ns


class Traced(Message):
    """A message that descends from one camera frame and carries the frame's capture time and every hop since."""

    captured_at_ns: Nanoseconds
    """Middle of the exposure of the frame that this datum descends from, UTC ns. Never re-stamped."""
    hops: Annotated[tuple[Hop, ...], Field(max_length=16)] = ()
    """The services passed so far, first to last. The runtime appends one at each publication."""

    @property
    def stamp_ns(self) -> int:
        """See `Message.stamp_ns`."""
        return self.captured_at_ns

    def with_hop(self, hop: Hop) -> Self:
        """The same message with one hop more."""
        return self.model_copy(update={"hops": (*self.hops, hop)})


class GlobalPosition(Part):
    """A point on or above the earth."""

    latitude_deg: Annotated[float, Field(ge=-90.0, le=90.0)]
    """Geodetic latitude, WGS84, degrees."""
    longitude_deg: Annotated[float, Field(ge=-180.0, le=180.0)]
    """Longitude, WGS84, degrees."""
    altitude_amsl_m: Annotated[float, Field(ge=-1e4, le=1e5)]
    """Altitude above mean sea level, metres: what MAVLink and PX4 take and give."""
    ellipsoidal_height_m: Annotated[float, Field(ge=-1e4, le=1e5)]
    """Height above the WGS84 ellipsoid, metres. Equals the AMSL altitude where no geoid separation is known."""
