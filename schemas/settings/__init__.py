"""Everything that can be set, one file a section. `Settings` is the whole TOML file."""

from pydantic import Field

from schemas.settings.bus import BusSettings
from schemas.settings.camera import CameraSettings
from schemas.settings.commander import CommanderSettings
from schemas.settings.detector import DetectorSettings
from schemas.settings.filter import FilterSettings
from schemas.settings.geolocator import GeolocatorSettings
from schemas.settings.lockstep import LockstepSettings
from schemas.settings.pad import PadSettings
from schemas.settings.process import ProcessSettings
from schemas.settings.recorder import RecorderSettings
from schemas.settings.section import Section
from schemas.settings.simulator import SimulatorSettings

__all__ = ["Section", "Settings"]


class Settings(Section):
    """The settings of all services. Each section has defaults that fly the embedded simulator."""

    vehicle: str = Field(default="v1", pattern=r"^[a-z0-9_-]{1,32}$")
    """Name of the vehicle in every key: `alight/<vehicle>/...`."""
    seed: int = Field(default=0, ge=0, lt=2**31)
    """Seeds everything that is random."""
    bus: BusSettings = BusSettings()
    process: ProcessSettings = ProcessSettings()
    pad: PadSettings = PadSettings()
    camera: CameraSettings = CameraSettings()
    detector: DetectorSettings = DetectorSettings()
    geolocator: GeolocatorSettings = GeolocatorSettings()
    filter: FilterSettings = FilterSettings()
    commander: CommanderSettings = CommanderSettings()
    simulator: SimulatorSettings = SimulatorSettings()
    recorder: RecorderSettings = RecorderSettings()
    lockstep: LockstepSettings = LockstepSettings()
