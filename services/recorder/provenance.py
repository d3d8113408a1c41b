"""What made a recording: versions, vehicle, seed, settings.

No time of day, no process id: the same flight twice is the same file twice.
"""

import platform
from importlib.metadata import PackageNotFoundError, version

import cv2

from schemas.message import SCHEMA_VERSION
from schemas.settings import Settings

_PACKAGES = {"alight": "alight", "mcap": "mcap", "numpy": "numpy", "pydantic": "pydantic", "zenoh": "eclipse-zenoh"}


def provenance(settings: Settings) -> dict[str, str]:
    """Names and values for the metadata record, in alphabetical order."""
    known = {name: _version(package) for name, package in _PACKAGES.items()}
    known |= {"opencv": cv2.__version__, "python": platform.python_version(), "schema": str(SCHEMA_VERSION)}
    known |= {"seed": str(settings.seed), "vehicle": settings.vehicle}
    return dict(sorted(known.items()))


def recorded_settings(settings: Settings) -> bytes:
    """All settings as JSON, without the folder that the recording lies in."""
    return settings.model_dump_json(indent=1, exclude={"recorder": {"directory"}}).encode()


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
