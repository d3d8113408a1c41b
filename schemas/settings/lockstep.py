"""Settings of lockstep flights: how long things take in virtual time."""

from pydantic import Field

from schemas.settings.section import Section


class LockstepSettings(Section):
    """Virtual durations, so that a lockstep flight sees the latencies of a live one and still repeats to the byte."""

    hop_s: float = Field(default=0.0005, ge=0.0, le=1.0)
    """From publication to arrival, seconds."""
    processing_s: dict[str, float] = Field(
        default_factory=lambda: {
            "detector": 0.008,
            "geolocator": 0.0005,
            "filter": 0.0002,
            "commander": 0.0003,
        }
    )
    """From arrival to publication, seconds, by service; absent means none."""
    camera_rate_hz: float = Field(default=10.0, gt=0.0, le=240.0)
    """Frames a second at most: a lockstep flight spends its time on drawing and detecting, so fewer of them fly faster."""
    picture_rate_hz: float = Field(default=5.0, ge=0.0, le=240.0)
    """Pictures a second that the recording keeps; 0 keeps all."""
