"""A flight in one process on the virtual clock: every service's node, the director, and a pipe for MAVLink."""

import importlib
import time
from collections.abc import Callable
from dataclasses import dataclass

from alight.runtime.clock import nanoseconds, seconds
from alight.runtime.lockstep import Lockstep
from alight.runtime.node import Node
from schemas.settings import Settings
from station.director import FlightDirector, FlightPlan

SERVICES = ("simulator", "commander", "camera", "detector", "geolocator", "filter", "recorder")
SETTLE_S = 1.0
"""Flown on after the end, so that the recording shows the vehicle at rest."""
SLICE_S = 0.25


@dataclass(frozen=True)
class LockstepOutcome:
    """How a lockstep flight went."""

    failure: str | None
    """None after a landing."""
    flown_s: float
    """Virtual seconds."""
    took_s: float
    """Wall seconds."""


def fly_lockstep(
    settings: Settings,
    plan: FlightPlan,
    on_progress: Callable[[FlightDirector], None] = lambda _: None,
    recorder: Node | None = None,
    camera: Node | None = None,
    director: FlightDirector | None = None,
) -> LockstepOutcome:
    """Fly once; the recording is in `settings.recorder.directory` afterwards, unless another `recorder` was given.

    Another `camera` or `director` than those of the settings and the plan may be given, too.
    """
    settings = at_lockstep_rate(settings)
    director = director or FlightDirector(settings, plan)
    given = {"camera": camera, "recorder": recorder}
    nodes = {name: given.get(name) or build_node(name, settings) for name in SERVICES}
    lockstep = Lockstep([*nodes.values(), director], settings)
    lockstep.join(nodes["simulator"], "vehicle", nodes["commander"], "vehicle")
    began_ns, began_s = lockstep.clock.now_ns(), time.perf_counter()
    while not lockstep.run(lockstep.clock.now_ns() + nanoseconds(SLICE_S), lambda: director.over):
        on_progress(director)
    on_progress(director)
    lockstep.run(lockstep.clock.now_ns() + nanoseconds(SETTLE_S))
    flown_s = seconds(lockstep.clock.now_ns() - began_ns)
    lockstep.close()
    return LockstepOutcome(director.failure, flown_s, time.perf_counter() - began_s)


def at_lockstep_rate(settings: Settings) -> Settings:
    """The settings with which a lockstep flight is flown: fewer frames, fewer pictures recorded."""
    rate_hz = min(settings.camera.rate_hz, settings.lockstep.camera_rate_hz)
    recorded_hz = settings.recorder.frame_rate_hz or settings.lockstep.picture_rate_hz
    update = {
        "camera": settings.camera.model_copy(update={"rate_hz": rate_hz}),
        "recorder": settings.recorder.model_copy(update={"frame_rate_hz": recorded_hz}),
    }
    return settings.model_copy(update=update)


def build_node(name: str, settings: Settings) -> Node:
    """One service's node."""
    node: Node = importlib.import_module(f"services.{name}.service").build(settings)
    return node
