"""What made a recording: versions, source, vehicle, seed, settings.

No time of day, no process id: the same flight twice is the same file twice.
"""

import hashlib
import importlib
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import cv2

from schemas.message import SCHEMA_VERSION
from schemas.settings import Settings
from services.recorder import layout

_PACKAGES = {
    "alight": "alight",
    "mcap": "mcap",
    "numpy": "numpy",
    "pydantic": "pydantic",
    "pymavlink": "pymavlink",
    "zenoh": "eclipse-zenoh",
}
_OUR_PACKAGES = ("schemas", "alight", "services")
_LONGEST_DOCUMENT_BYTES = 1024 * 1024


@dataclass(frozen=True)
class Document:
    """Something that lies beside the messages, whole."""

    name: str
    media_type: str
    data: bytes


def provenance(settings: Settings) -> dict[str, str]:
    """Names and values for the metadata record, in alphabetical order."""
    known = {name: _version(package) for name, package in _PACKAGES.items()}
    known |= {"opencv": cv2.__version__, "python": platform.python_version(), "schema": str(SCHEMA_VERSION)}
    known |= {"machine": platform.machine(), "source": source_digest()}
    known |= {"seed": str(settings.seed), "vehicle": settings.vehicle}
    return dict(sorted(known.items()))


def documents(settings: Settings) -> Iterator[Document]:
    """The settings, the pad and the correction, and the files that the settings name."""
    # The folder of the recording is left out: where it lies is no part of the flight.
    everything = settings.model_dump_json(indent=1, exclude={"recorder": {"directory"}})
    yield Document(layout.SETTINGS_ATTACHMENT, "application/json", everything.encode())
    yield _json(layout.PAD_ATTACHMENT, settings.pad.model_dump_json(indent=1))
    yield _json(layout.CORRECTION_ATTACHMENT, settings.geolocator.correction.model_dump_json(indent=1))
    for name in (settings.pad.layout, settings.camera.calibration_file, settings.geolocator.correction_file):
        yield from _named(Path(name))


@cache
def source_digest() -> str:
    """Says which source text flew, without version control: SHA-256 over our modules' paths and bytes, 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for name in _OUR_PACKAGES:
        root = Path(next(iter(importlib.import_module(name).__path__)))
        for path in sorted(root.rglob("*.py")):
            digest.update(f"{name}/{path.relative_to(root).as_posix()}\0".encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _json(name: str, text: str) -> Document:
    return Document(name, "application/json", text.encode())


def _named(path: Path) -> Iterator[Document]:
    """A file that the settings name, if it is one: who needs it says so where it cannot be read."""
    try:
        if path.is_file() and path.stat().st_size <= _LONGEST_DOCUMENT_BYTES:
            yield Document(path.name, "text/plain", path.read_bytes())
    except OSError:
        return


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
