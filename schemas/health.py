"""How each service is doing, once a second."""

from typing import Annotated

from pydantic import Field

from schemas.message import Part, ShortText, Stamped

Count = Annotated[int, Field(ge=0)]


class InputHealth(Part):
    """One topic that the service reads."""

    topic: ShortText
    """Its name in the table of topics."""
    received: Count
    """Messages accepted since the process started."""
    rate_hz: Annotated[float, Field(ge=0.0)]
    """Messages accepted a second, over the last period."""
    dropped: Count
    """Messages overwritten by newer ones before the service could take them up, since start."""
    refused: dict[str, Count]
    """Messages refused since start, by reason."""
    age_s: float | None = None
    """Since the last accepted message, seconds; None if there was none."""
    stale: bool
    """Whether the topic has been silent for longer than its staleness limit."""


class OutputHealth(Part):
    """One topic that the service publishes."""

    topic: ShortText
    """Its name in the table of topics."""
    published: Count
    """Messages published since the process started."""
    rate_hz: Annotated[float, Field(ge=0.0)]
    """Messages published a second, over the last period."""
    latency_p50_ms: float | None = None
    """Median from capture to publication over the last period, ms; None for what descends from no frame."""
    latency_p99_ms: float | None = None
    """99th percentile of the same, ms."""


class ClockHealth(Part):
    """How well another clock is known: that of the autopilot, or that of the host of a service which this one hears."""

    of: ShortText
    """`autopilot`, or the service whose host's clock it is."""
    host: ShortText = ""
    """Name of that host; empty for the autopilot, and as long as the service has not answered."""
    offset_s: float | None = None
    """That clock minus ours, seconds; None if it is not known, and for the autopilot, which counts from its boot."""
    round_trip_s: Annotated[float, Field(ge=0.0)] | None = None
    """Of the question that the offset rests on, seconds: it may be wrong by half of it."""
    uncertainty_s: Annotated[float, Field(ge=0.0)] | None = None
    """How wrong a time that is carried from one clock to the other may be, seconds."""
    jitter_s: Annotated[float, Field(ge=0.0)] | None = None
    """By how much the answers contradict each other, root mean square, seconds."""
    drift_ppm: float | None = None
    """How much faster that clock runs than ours, parts per million; None where it was not watched for long enough."""
    answers: Count = 0
    """Answers used since start."""
    outliers: Count = 0
    """Answers left out since start: late, impossible, or against all others."""
    age_s: Annotated[float, Field(ge=0.0)] | None = None
    """Since the last answer, seconds; None if there was none."""


class Health(Stamped):
    """One service's account of itself."""

    service: ShortText
    """Name of the service."""
    pid: Count
    """Process id; 0 in lockstep."""
    uptime_s: Annotated[float, Field(ge=0.0)]
    """Since the process started, seconds."""
    inputs: tuple[InputHealth, ...]
    """What it reads."""
    outputs: tuple[OutputHealth, ...]
    """What it publishes."""
    handling_p50_ms: float | None = None
    """Median time to handle one message over the last period, ms."""
    handling_p99_ms: float | None = None
    """99th percentile of the same, ms."""
    counters: dict[str, Count]
    """The service's own counters since start, such as refused fixes by verdict."""
    complaints: tuple[ShortText, ...]
    """What is wrong now, in words; empty when all is well."""
    clocks: tuple[ClockHealth, ...] = ()
    """Other clocks, as far as it measures them; empty in lockstep, where there is but one."""
