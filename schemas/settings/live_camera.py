"""Settings of a camera that is there: a device of this machine, or a stream from the network."""

from typing import Literal

from pydantic import Field

from schemas.settings.section import Section


class LiveCamera(Section):
    """The sources `device` and `stream`. Size and rate are asked of a device; a stream has its own."""

    device: str = Field(default="/dev/video0", min_length=1, max_length=200)
    """For `device`: the V4L2 device, a path (better one from /dev/v4l/by-id, which stays) or a number."""
    url: str = Field(default="", max_length=1000)
    """For `stream`: rtsp://, udp://, tcp://, http:// or https:// (through FFmpeg), or a GStreamer pipeline that ends in `appsink`."""
    via: Literal["ffmpeg", "gstreamer"] = "ffmpeg"
    """For `stream`: who reads it. `gstreamer` needs an OpenCV that was built with it; the one from PyPI was not."""
    pixel_format: str = Field(default="", pattern=r"^([A-Z0-9]{4})?$")
    """For `device`: four characters such as `GREY`, `YUYV` or `MJPG`; empty leaves the driver's choice."""
    exposure_ms: float | None = Field(default=None, gt=0.0, le=1000.0)
    """For `device`: a fixed exposure, milliseconds; None leaves the automatic one. Short ones keep the marker sharp in motion."""
    stamp: Literal["driver", "read"] = "driver"
    """Where a frame's time is taken from: the driver's stamp where it gives a credible one (V4L2), else when the frame was read."""
    delay_s: float = Field(default=0.0, ge=-1.0, le=5.0)
    """From the middle of the exposure to that stamp, seconds; it is subtracted. `alight calibrate delay` finds it. Leave
    `geolocator.lookup.image_latency_s` at 0 then: it is subtracted, too. A wrong value shifts the pad by speed times error."""
    rotated_deg: Literal[0, 90, 180, 270] = 0
    """How far the pictures must be turned clockwise to stand as the calibrated camera saw them, degrees."""
    mirrored: bool = False
    """The pictures are mirror images: flip them left to right, before they are turned."""
    silent_s: float = Field(default=2.0, gt=0.0, le=60.0)
    """After so long without a frame the source is opened anew, seconds."""
    longest_pause_s: float = Field(default=5.0, gt=0.0, le=300.0)
    """The pauses between attempts to open it double from 0.2 s up to this, seconds."""
