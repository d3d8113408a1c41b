"""The reference flights in `flights/` are tests; `python -m station.replay.reference` makes them anew."""

from station.replay.pytest_plugin import pytest_collect_file, replay_flight  # noqa: F401
