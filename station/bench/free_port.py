"""A port of this host's loopback for a bench's own processes."""

import socket


def free_port(kind: int = socket.SOCK_STREAM) -> int:
    """One that is free now; `kind` is that of the socket, TCP by default."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
