"""Which software flies: only flights of the same software may stand in one table."""

import hashlib
import platform
from functools import cache
from importlib.metadata import version
from pathlib import Path

_FLIES = (
    "schemas",
    "alight",
    "services",
    "station/metrics",
    "station/director.py",
    "station/lockstep_flight.py",
    "station/campaign/fly_task.py",
    "station/campaign/memory_recorder.py",
    "station/campaign/row.py",
)
"""What of this program a flight runs through."""
_STANDS_ON = ("numpy", "opencv-python-headless", "pydantic", "pymavlink")


@cache
def software() -> str:
    """Versions and a digest of the source, in one line; equal if and only if the same software flies."""
    digest = hashlib.sha256()
    root = Path(__file__).parents[2]
    for name in _FLIES:
        path = root / name
        for file in [path] if path.is_file() else sorted([*path.rglob("*.py"), *path.rglob("*.toml")]):
            digest.update(f"{file.relative_to(root).as_posix()}\0".encode() + file.read_bytes() + b"\0")
    versions = [f"{name} {version(name)}" for name in _STANDS_ON]
    return ", ".join([f"alight {digest.hexdigest()[:16]}", f"python {platform.python_version()}", *versions])
