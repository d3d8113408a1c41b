"""How the processes find each other."""

import re
from typing import Any, Literal

from pydantic import Field, field_validator

from schemas.settings.section import Section

_ENDPOINT = re.compile(r"(?P<protocol>[a-z][a-z0-9_-]*)/(?P<address>[^?#]+)(\?[^#]*)?(#.*)?")
"""Zenoh's form: `PROTOCOL/ADDRESS[?METADATA][#CONFIGURATION]`."""
_HOST_AND_PORT = re.compile(r"[^/\s]+:(?P<port>[0-9]{1,5})")
_ON_IP = ("tcp", "udp", "tls", "quic", "ws")
"""Protocols whose address is HOST:PORT. Those of other protocols (`serial`, `unixsock-stream`, `vsock`...) are Zenoh's to judge."""
_EXAMPLE = "192.168.1.5:7447"


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

    @field_validator("connect", "listen", mode="before")
    @classmethod
    def _check_list(cls, value: Any) -> Any:
        if not isinstance(value, list | tuple):
            raise ValueError(f'a list is wanted, such as ["tcp/{_EXAMPLE}"]; in a shell put it within single quotes')
        return value

    @field_validator("connect", "listen")
    @classmethod
    def _check_endpoints(cls, endpoints: tuple[str, ...]) -> tuple[str, ...]:
        for endpoint in endpoints:
            if not _is_endpoint(endpoint):
                meant = endpoint if _is_host_and_port(endpoint) else _EXAMPLE
                raise ValueError(f'{endpoint!r} is no endpoint: write tcp/HOST:PORT, such as ["tcp/{meant}"]')
        return endpoints


def _is_endpoint(text: str) -> bool:
    match = _ENDPOINT.fullmatch(text)
    return match is not None and (match["protocol"] not in _ON_IP or _is_host_and_port(match["address"]))


def _is_host_and_port(address: str) -> bool:
    match = _HOST_AND_PORT.fullmatch(address)
    return match is not None and int(match["port"]) < 2**16
