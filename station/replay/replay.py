"""One flight through chosen nodes: which journals, which settings, which tolerances."""

from collections.abc import Mapping, Sequence

from schemas.settings import Settings
from station.replay.cursor import build
from station.replay.engine import CHAIN, Engine
from station.replay.error import ReplayError
from station.replay.life import Life, journalled_lives
from station.replay.log_order import guessed_life
from station.replay.recorded_settings import settings_of
from station.replay.recording import ReplayRecording
from station.replay.result import ReplayResult
from station.replay.tolerance import EXACT, LOSSY, Tolerances


def replay(
    recording: ReplayRecording,
    services: Sequence[str],
    assignments: Sequence[str] = (),
    tolerances: Tolerances | None = None,
) -> ReplayResult:
    """Replay a flight.

    Args:
        recording: The flight.
        services: Which nodes, any order, of `CHAIN`.
        assignments: `section.key=value`, set over the flight's own settings.
        tolerances: For the comparison; by default exact, but for pictures that were compressed with loss or of which not all were kept.

    Raises:
        ReplayError: If the flight cannot be replayed so.
        SettingsError: If the flight's settings do not fit this version, or an assignment is at fault.
    """
    unknown = sorted(set(services) - set(CHAIN))
    if unknown or not services:
        raise ReplayError(f"--through {','.join(services)}: name some of {','.join(CHAIN)}")
    settings, remarks = settings_of(recording, assignments)
    chosen = tolerances or _tolerances(recording, services)
    try:
        lives = {service: _lives(recording, service, settings) for service in services}
        engine = Engine(recording, settings, lives, chosen)
    except ReplayError:
        raise
    except ValueError as error:
        raise ReplayError(f"{recording.path}: {error}") from error
    result = engine.run()
    result.assignments = tuple(assignments)
    result.remarks[:0] = [*recording.defects, *remarks]
    return result


def _lives(recording: ReplayRecording, service: str, settings: Settings) -> Sequence[Life]:
    found = journalled_lives(recording, service)
    return found or [guessed_life(recording, service, build(service, settings).tick_period_ns)]


def _tolerances(recording: ReplayRecording, services: Sequence[str]) -> Tolerances:
    recorder: Mapping[str, object] = recording.settings.get("recorder", {})
    lossy = recorder.get("frames") == "jpeg" or _is_thinned(recording)
    return LOSSY if "detector" in services and lossy else EXACT


def _is_thinned(recording: ReplayRecording) -> bool:
    """Whether fewer pictures were kept than taken: a detector that follows the pad begins from the frame before."""
    recorder, camera = recording.settings.get("recorder", {}), recording.settings.get("camera", {})
    kept_hz, taken_hz = float(recorder.get("frame_rate_hz", 0.0)), float(camera.get("rate_hz", 0.0))
    return 0.0 < kept_hz < taken_hz
