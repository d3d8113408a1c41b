"""Moving air."""

from schemas.settings.simulator import Wind
from services.simulator.noise import GaussMarkov, Normals


class WindField:
    """Steady wind and gusts; the same everywhere."""

    def __init__(self, settings: Wind, normals: Normals, step_s: float) -> None:
        self._settings = settings
        self._gust_north = GaussMarkov(normals, settings.gust_mps, settings.gust_time_s, step_s)
        self._gust_east = GaussMarkov(normals, settings.gust_mps, settings.gust_time_s, step_s)
        self._gust_down = GaussMarkov(normals, 0.5 * settings.gust_mps, settings.gust_time_s, step_s)
        self._gusty = settings.gust_mps > 0.0
        self.velocity_ned_mps = self._velocity()
        """Velocity of the air, north, east, down, m/s."""

    def advance(self) -> None:
        """Go one step on."""
        if self._gusty:
            self._gust_north.advance()
            self._gust_east.advance()
            self._gust_down.advance()
            self.velocity_ned_mps = self._velocity()

    def _velocity(self) -> tuple[float, float, float]:
        return (
            self._settings.north_mps + self._gust_north.value,
            self._settings.east_mps + self._gust_east.value,
            self._gust_down.value,
        )
