"""Settings of the recorder service."""

from pathlib import Path
from typing import Literal

from pydantic import Field

from schemas.settings.section import Section


class RecorderSettings(Section):
    """What is written to the flight's file."""

    directory: Path = Path("flights/recorded")
    """Folder of the recording, made if it is missing. It is left out of the settings that the recording carries."""
    file_name: str = Field(default="flight.mcap", pattern=r"^[A-Za-z0-9._-]{1,100}\.mcap$")
    """Name of the file in that folder. Nothing is overwritten: a recorder that starts again goes on in `flight_2.mcap`."""
    frames: Literal["jpeg", "png", "raw", "none"] = "jpeg"
    """How pictures are kept: `jpeg` (about 1 ms and 50 kB each at 640x480), `raw` (bit by bit, about 1 ms and 220 kB), `png` (lossless,
    about 10 ms and 190 kB), `none`."""
    jpeg_quality: int = Field(default=80, ge=1, le=100)
    """Quality of JPEG pictures, 1 to 100."""
    frame_rate_hz: float = Field(default=0.0, ge=0.0, le=1000.0)
    """At most so many pictures a second, evenly spread; 0 keeps all. Frame headers are always kept."""
    compression: Literal["zstd", "lz4", "none"] = "zstd"
    """Compression of each chunk of the file."""
    chunk_bytes: int = Field(default=4 * 1024 * 1024, ge=4096, le=256 * 1024 * 1024)
    """A chunk is closed when it is longer than this, bytes before compression."""
    flush_period_s: float = Field(default=0.5, gt=0.0, le=60.0)
    """A chunk is closed and handed to the operating system at least so often, seconds: what a crash loses at most."""
    sync_period_s: float = Field(default=1.0, ge=0.0, le=60.0)
    """The disk itself has everything at least so often, seconds: what a loss of power loses at most; 0 leaves it to the operating system."""
    backlog_mb: float = Field(default=64.0, ge=1.0, le=4096.0)
    """What may wait for a slow disk, megabytes; pictures are given up at three quarters of it, messages at all of it."""
    rotate_mb: float = Field(default=0.0, ge=0.0, le=1e6)
    """Go on in the next file (`flight_2.mcap`) once one is longer than this, megabytes; none covers less than a second; 0 for never."""
    rotate_s: float = Field(default=0.0, ge=0.0, le=1e6)
    """Go on in the next file once one covers more time than this, seconds, at least 1; 0 for never."""
    quota_mb: float = Field(default=0.0, ge=0.0, le=1e7)
    """What all recordings in the folder above `directory` may take together, megabytes: the oldest go first, the present one never; 0 for no limit."""
    pre_trigger_s: float = Field(default=0.0, ge=0.0, le=600.0)
    """Keep only this many seconds, in memory, until a landing is asked for; then write them and go on. 0 records from the start."""
    pre_trigger_mb: float = Field(default=256.0, ge=1.0, le=16384.0)
    """What those seconds may take, megabytes; when they take more, fewer are kept."""
