"""Corrections in files, as `alight calibrate bias` writes them."""

import tomllib
from pathlib import Path

from pydantic import ValidationError

from schemas.settings.geolocator import Correction, GeolocatorSettings

VERSION = 1
"""Of the file's layout."""
_REMEDY = "make it anew with alight calibrate bias"


class CorrectionFileError(ValueError):
    """A correction that cannot be used: file, key and remedy in one line."""


def configured_correction(settings: GeolocatorSettings) -> Correction:
    """The correction that the settings give, from the file they name or their own section.

    Raises:
        CorrectionFileError: If the file is missing or wrong.
    """
    return read_correction(Path(settings.correction_file)) if settings.correction_file else settings.correction


def read_correction(path: Path) -> Correction:
    """Read the table `correction` of a TOML file with `version = 1`; the rest of it is for people.

    Raises:
        CorrectionFileError: If the file is missing or wrong.
    """
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise CorrectionFileError(
            f"{path}: cannot be read ({error.strerror}): correct geolocator.correction_file"
        ) from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise CorrectionFileError(f"{path}: not valid TOML ({error}): {_REMEDY}") from None
    if table.get("version") != VERSION:
        raise CorrectionFileError(f"{path}: version {table.get('version')!r}, this program reads {VERSION}: {_REMEDY}")
    try:
        return Correction.model_validate(table.get("correction"))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        name = ".".join(("correction", *(str(part) for part in first["loc"])))
        raise CorrectionFileError(f"{path}: {name}: {first['msg']}: {_REMEDY}") from None
