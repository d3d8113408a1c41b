"""What every test may use."""

from pathlib import Path

import hypothesis
import pytest

from schemas.settings import Settings

# No test depends on how quick the machine is, and each draws the same examples every time.
hypothesis.settings.register_profile("alight", deadline=None, derandomize=True)
hypothesis.settings.load_profile("alight")


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    """The defaults, recording into a folder of the test's own."""
    return Settings.model_validate({"recorder": {"directory": str(tmp_path / "flight")}})
