"""How a detection that yields no fix is turned away."""

from schemas.fix import FixVerdict


class FixRefusedError(Exception):
    """There is no fix, for the reason that the verdict names."""

    def __init__(self, verdict: FixVerdict, detail: str) -> None:
        super().__init__(detail)
        self.verdict = verdict
        self.detail = detail
