"""Settings of the simulator service."""

from schemas.settings.section import Section


class SimulatorSettings(Section):
    """The vehicle and the world, where there is no real one."""
