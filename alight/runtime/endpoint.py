"""Byte ports to the outside: UDP sockets and serial lines, named by a URL.

`udpin://HOST:PORT`            bind there, hear and answer who writes first, as `Correspondent` says (PX4 sends to its companion's port);
`udpout://HOST:PORT`           send there, receive the answers;
`udp://HOST:PORT?to=HOST:PORT` bind there, send there;
`serial:///dev/ttyUSB0?baud=57600`  a telemetry radio or UART (needs the extra `alight[serial]`).
"""

import contextlib
import errno
import socket
import threading
from collections.abc import Callable
from typing import Any
from urllib.parse import parse_qs, urlsplit

from alight.runtime.clock import Clock, MonotonicClock
from alight.runtime.correspondent import Address, Correspondent
from alight.runtime.port import Port, PortError

MAX_DATAGRAM_BYTES = 65535


def open_endpoint(url: str) -> Port:
    """The port that a URL names; it is opened by its `open`.

    Raises:
        PortError: If the URL names none, with the forms that do.
    """
    parts = urlsplit(url)
    query = parse_qs(parts.query)
    try:
        if parts.scheme == "udpin" and parts.port is not None:
            return UdpPort(bind=(parts.hostname or "0.0.0.0", parts.port), to=None)
        if parts.scheme == "udpout" and parts.hostname and parts.port:
            return UdpPort(bind=None, to=(parts.hostname, parts.port))
        if parts.scheme == "udp" and parts.port is not None and "to" in query:
            host, port = query["to"][0].rsplit(":", 1)
            return UdpPort(bind=(parts.hostname or "0.0.0.0", parts.port), to=(host, int(port)))
        if parts.scheme == "serial" and parts.path:
            return SerialPort(parts.path, int(query.get("baud", ["57600"])[0]))
    except ValueError as error:
        raise PortError(f"{url}: {error}; use udpin://0.0.0.0:14540, for example") from None
    raise PortError(
        f"{url}: not an endpoint; use udpin://HOST:PORT, udpout://HOST:PORT, udp://HOST:PORT?to=HOST:PORT "
        "or serial:///dev/ttyUSB0?baud=57600"
    )


class UdpPort:
    """A UDP socket with a thread that receives."""

    def __init__(self, bind: tuple[str, int] | None, to: tuple[str, int] | None, clock: Clock | None = None) -> None:
        """Open nothing yet.

        Args:
            bind: Host and port to listen at; any free port if None.
            to: Host and port to send to; None hears and answers the first who writes, as `Correspondent` says.
            clock: For how long that one has been silent; one that nobody sets. The host's by default.
        """
        self._bind = bind
        self._to = to
        self._correspondent = Correspondent() if to is None else None
        self._clock: Clock = clock or MonotonicClock()
        self._socket: socket.socket | None = None

    def open(self, deliver: Callable[[bytes], None]) -> None:
        """See `Port.open`."""
        connection = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        try:
            connection.bind(self._bind or ("", 0))
        except OSError as error:
            connection.close()
            host, port = self._bind or ("", 0)
            remedy = (
                "end the program that holds it, or set another port" if error.errno == errno.EADDRINUSE else "check it"
            )
            raise PortError(f"UDP port {host}:{port} cannot be had ({error.strerror}): {remedy}") from None
        self._socket = connection
        threading.Thread(target=self._receive, args=(connection, deliver), daemon=True).start()

    def send(self, data: bytes) -> None:
        """See `Port.send`."""
        if self._socket is not None and self._to is not None:
            with contextlib.suppress(OSError):
                self._socket.sendto(data, self._to)

    def close(self) -> None:
        """See `Port.close`."""
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)
            self._socket.close()
            self._socket = None

    def _receive(self, connection: socket.socket, deliver: Callable[[bytes], None]) -> None:
        while self._socket is connection:
            try:
                data, sender = connection.recvfrom(MAX_DATAGRAM_BYTES)
            except ConnectionRefusedError:
                continue  # nobody listens at the other end yet
            except OSError:
                return
            if not data:
                continue  # it says nothing, and is what comes of a socket that is closed, from nobody
            if self._correspondent is not None:
                if not self._correspondent.admits(Address(*sender), self._clock.now_ns()):
                    continue
                self._to = sender
            deliver(data)


class SerialPort:
    """A serial line through pyserial, with a thread that receives; a line that breaks off is reopened."""

    def __init__(self, device: str, baud: int) -> None:
        self._device = device
        self._baud = baud
        self._line: Any = None
        self._closing = threading.Event()

    def open(self, deliver: Callable[[bytes], None]) -> None:
        """See `Port.open`."""
        try:
            self._line = self._connect()
        except OSError as error:
            raise PortError(
                f"serial line {self._device} cannot be opened ({error}): check the device and its permissions"
            ) from None
        threading.Thread(target=self._receive, args=(deliver,), daemon=True).start()

    def send(self, data: bytes) -> None:
        """See `Port.send`."""
        with contextlib.suppress(OSError):
            self._line.write(data)

    def close(self) -> None:
        """See `Port.close`."""
        self._closing.set()
        if self._line is not None:
            self._line.close()

    def _connect(self) -> Any:
        try:
            import serial  # noqa: PLC0415 - an extra: only who has a serial line needs it
        except ImportError:
            raise PortError("a serial line needs pyserial: pip install 'alight[serial]'") from None
        return serial.Serial(self._device, self._baud, timeout=0.1, write_timeout=0.1)

    def _receive(self, deliver: Callable[[bytes], None]) -> None:
        while not self._closing.is_set():
            try:
                data = self._line.read(max(1, self._line.in_waiting))
                if data:
                    deliver(bytes(data))
            except OSError:
                self._closing.wait(0.5)
                with contextlib.suppress(OSError):
                    self._line = self._connect()
