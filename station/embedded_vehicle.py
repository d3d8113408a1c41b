"""Whether the vehicle that the commander would fly is the simulator's own.

`alight fly` takes off unasked with the embedded simulator only. A link that leads anywhere else is somebody's vehicle, and
that is flown only where `--vehicle` names it: a link that a file or the environment brings along is no such word.
"""

import ipaddress
from urllib.parse import parse_qs, urlsplit

from alight.runtime.settings_file import SettingsError
from schemas.settings import Settings

Address = tuple[str, int]


def check_link_to_embedded(settings: Settings) -> None:
    """See that the commander hears the embedded autopilot and nobody else.

    Raises:
        SettingsError: If it listens elsewhere than on the very loopback address to which the embedded autopilot sends.
    """
    heard, told = settings.commander.vehicle_url, settings.simulator.url
    if _listens_on(heard) is None or _listens_on(heard) != _sends_to(told):
        raise SettingsError(
            f"commander.vehicle_url is {heard}, but the embedded simulator is at simulator.url {told}: to fly the vehicle "
            f"at that link add --vehicle {heard}; to fly the simulator let both name one port of 127.0.0.1, such as "
            "udpin://127.0.0.1:PORT and udp://127.0.0.1:OTHER?to=127.0.0.1:PORT"
        )


def check_kind_is_embedded(settings: Settings) -> None:
    """See that the simulator is one that can be flown, not one that only reads another's truth.

    Raises:
        SettingsError: If it is the latter.
    """
    if settings.simulator.kind != "embedded":
        raise SettingsError(
            f"simulator.kind is {settings.simulator.kind}, which flies nothing itself: name the PX4 simulation with "
            f"--vehicle {settings.commander.vehicle_url} --truth {settings.simulator.truth_url}, or set simulator.kind=embedded"
        )


def _listens_on(url: str) -> Address | None:
    """The loopback address at which an endpoint listens; None if it listens to others than this machine, or not at all."""
    try:
        parts = urlsplit(url)
        return _loopback(parts.hostname, parts.port) if parts.scheme == "udpin" else None
    except ValueError:
        return None


def _sends_to(url: str) -> Address | None:
    """The loopback address to which an endpoint sends; None if it does not, or waits until it is written to."""
    try:
        parts = urlsplit(url)
        if parts.scheme == "udpout":
            return _loopback(parts.hostname, parts.port)
        host, _, port = parse_qs(parts.query)["to"][0].rpartition(":")
        return _loopback(host, int(port)) if parts.scheme == "udp" else None
    except (ValueError, LookupError):
        return None


def _loopback(host: str | None, port: int | None) -> Address | None:
    """Host and port where the host is this machine's loopback.

    Raises:
        ValueError: If the host is neither an IP address nor `localhost`.
    """
    address = ipaddress.ip_address("127.0.0.1" if host == "localhost" else host or "")
    return (str(address), port) if address.is_loopback and port else None
