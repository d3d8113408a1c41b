"""How the processes find each other."""

from typing import Literal

from pydantic import Field

from schemas.settings.section import Section


class BusSettings(Section):
    """Zenoh endpoints. The defaults keep all traffic on this machine's loopback."""

    mode: Literal["peer", "client"] = "peer"
    """`peer` talks to other processes directly, `client` only through a router."""
    connect: tuple[str, ...] = ("tcp/127.0.0.1:7447",)
    """Where to find the others: the supervisor, a peer or a router, such as `tcp/192.0.2.1:7447`."""
    listen: tuple[str, ...] = ("tcp/127.0.0.1:0",)
    """Where this process may be reached; port 0 picks a free one. Empty for a client."""
    shared_memory: bool = True
    """Pass pixels through shared memory between processes on one host."""
    max_clock_skew_s: float = Field(default=0.2, gt=0.0, le=60.0)
    """A message that speaks of a time further in the future than this is refused."""
    health_period_s: float = Field(default=1.0, gt=0.0, le=60.0)
    """How often each service publishes its health."""
