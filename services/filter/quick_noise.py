"""How noisy the vehicle's position really is from one fix to the next: learnt from what fixes say that was not expected.

The settings say how noisy the position may be, since a filter that starts has nothing else to go by. Most solutions are
calmer; and near the ground, where a fix itself is good to millimetres, this noise rules what counts as expected. Told twice what
it is, the gate lets outliers of twice the size in, just where no later fix corrects them. (Mehra, *On the identification of
variances and adaptive Kalman filtering*, 1970; here each innovation counts by how much of it can be this noise.)
"""

from typing import NamedTuple, Self

from schemas.message import Vector3

_CALMEST = 0.3
"""Never less than so much of the settings' standard deviation: what consecutive fixes have in common shows in no innovation."""
_PRIOR = 30.0
"""The settings count as so many axes of fixes that show nothing but this noise."""
_KEPT = 1.0 - 1.0 / 300.0
"""How much an axis of a fix still counts when the next is in: a hundred fixes are remembered."""
_LARGEST = 9.0
"""An innovation counts up to so many times its expected square: one outlier does not open the gate to the next."""


class QuickNoise(NamedTuple):
    """What is known of the variance of the position's quick error."""

    most_m2: float
    """What the settings say, each axis, m^2."""
    asked_pm2: float = 0.0
    """Weighted sum of what the innovations asked for, 1/m^2."""
    weight_pm4: float = 0.0
    """Sum of the weights, 1/m^4."""

    @property
    def variance_m2(self) -> float:
        """Of each axis: what the settings say at most, and a tenth of that at least."""
        most = self.most_m2
        if most <= 0.0:
            return 0.0
        learnt = (_PRIOR / most + self.asked_pm2) / (_PRIOR / most**2 + self.weight_pm4)
        return min(max(learnt, _CALMEST**2 * most), most)

    def after(self, away_m: Vector3, variances_m2: Vector3) -> Self:
        """What is known with one more innovation.

        Args:
            away_m: Sighting minus expectation.
            variances_m2: What its squares were expected to be, this noise's own variance included.
        """
        quick_m2, asked_pm2, weight_pm4 = self.variance_m2, self.asked_pm2, self.weight_pm4
        for away, expected in zip(away_m, variances_m2, strict=True):
            if not expected > 0.0:
                return self
            weight = 1.0 / expected**2
            asked_m2 = min(away * away, _LARGEST * expected) - (expected - quick_m2)
            asked_pm2 = _KEPT * asked_pm2 + weight * asked_m2
            weight_pm4 = _KEPT * weight_pm4 + weight
        return self._replace(asked_pm2=asked_pm2, weight_pm4=weight_pm4)
