"""Nonsense in never leaves as a fix: whatever comes, in whatever order."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from geolocation_scene import CALIBRATION, HOME, MS, T0_NS, Scene, geolocator, show, tell
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from schemas import topics
from schemas.fix import FixVerdict, PadFix
from schemas.settings.geolocator import PAPER_MEAN_CORRECTION, Correction, Extrinsic, PadHeight
from schemas.vehicle import GimbalState

LOOKUP_MS = (150, 200)
"""How far a pose may be extrapolated, and how far apart two may be, by the settings' defaults."""

odd = st.one_of(
    st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -1.0, 1e-300, 1e300]),
    st.floats(-1e3, 1e3),
    st.floats(allow_nan=True, allow_infinity=True),
)
vectors = st.tuples(odd, odd, odd)
quaternions = st.tuples(odd, odd, odd, odd)
sometimes = st.booleans().flatmap


def or_sound(strategy):
    """Nonsense half of the time; None stands for what is sound."""
    return st.one_of(st.none(), strategy)


@dataclass(frozen=True)
class Step:
    """One message, some parts of which are nonsense."""

    kind: str
    after_ms: int
    first: object
    second: object
    third: object


steps = st.one_of(
    st.builds(Step, st.just("state"), st.integers(-300, 300), or_sound(quaternions), or_sound(vectors), or_sound(odd)),
    st.builds(Step, st.just("gimbal"), st.integers(-300, 300), or_sound(quaternions), st.none(), st.none()),
    st.builds(Step, st.just("lens"), st.just(0), or_sound(odd), or_sound(odd), st.none()),
    st.builds(Step, st.just("picture"), st.integers(-300, 300), or_sound(vectors), or_sound(quaternions), or_sound(st.lists(odd, min_size=36, max_size=36))),
)  # fmt: skip


def changed(message, **fields):
    """The message with what is given instead, past all validation."""
    return message.model_copy(update={name: value for name, value in fields.items() if value is not None})


class Told:
    """A geolocator, and the times of the vehicle states that it took."""

    def __init__(self, node):
        self.node, self.now_ns, self.state_times_ns, self.captured_ns = node, T0_NS, [], []

    def take(self, step):
        """Hand over one message; the fix, if that is what comes of it."""
        self.now_ns += step.after_ms * MS
        scene = Scene()
        if step.kind == "picture":
            covariance = None if step.third is None else tuple(step.third)
            pose = changed(
                scene.true_pose(), position_camera_m=step.first, q_camera_marker=step.second, covariance=covariance
            )
            fix = show(self.node, scene.marker().model_copy(update={"poses": (pose,)}), at_ns=self.now_ns)
            return fix
        if step.kind == "lens":
            tell(self.node, topics.CALIBRATION, changed(CALIBRATION, fx_px=step.first, fy_px=step.second))
        elif step.kind == "gimbal":
            sound = GimbalState(at_ns=self.now_ns, q_body_gimbal=scene.q_body_gimbal, measured=True)
            tell(self.node, topics.GIMBAL_STATE, changed(sound, q_body_gimbal=step.first))
        else:
            before = self.node.counters().get("vehicle_state_refused", 0)
            message = changed(
                scene.state(self.now_ns, position=scene.vehicle_position),
                q_ned_body=step.first,
                velocity_ned_mps=step.second,
                clock_uncertainty_s=step.third,
            )
            tell(self.node, topics.VEHICLE_STATE, message)
            if self.node.counters().get("vehicle_state_refused", 0) == before:
                self.state_times_ns.append(self.now_ns)
        return None


def check(fix, told):
    """A refused detection has a reason and no place; an accepted one is whole."""
    PadFix.model_validate_json(fix.model_dump_json())
    if fix.verdict is not FixVerdict.ACCEPTED:
        assert fix.detail
        assert fix.corrected is None
        assert fix.covariance_ned_m2 is None
        return
    assert fix.raw.pad_ned_m[2] > 0.0
    assert np.linalg.eigvalsh(np.reshape(fix.covariance_ned_m2, (3, 3))).min() > 0.0
    assert fix.azimuth_variance_rad2 > 0.0
    assert fix.captured_at_ns > max(told.captured_ns, default=-1)
    earlier = [t for t in told.state_times_ns if t <= fix.captured_at_ns]
    later = [t for t in told.state_times_ns if t > fix.captured_at_ns]
    assert earlier
    most_ms = LOOKUP_MS[1] if later and max(earlier) != fix.captured_at_ns else LOOKUP_MS[0]
    apart_ns = (min(later) if later else fix.captured_at_ns) - max(earlier)
    assert max(earlier) == fix.captured_at_ns or apart_ns <= most_ms * MS


@pytest.mark.parametrize(
    "settings",
    [
        {"method": "pnp"},
        {"method": "bearing", "height": PadHeight(pad_altitude_amsl_m=HOME.altitude_amsl_m)},
        {"method": "fused", "height": PadHeight(pad_altitude_amsl_m=HOME.altitude_amsl_m)},
        {"correction": PAPER_MEAN_CORRECTION},
        {"correction": Correction(method="extrinsic", extrinsic=Extrinsic(mount_roll_deg=2.0, focal_scale=1.01))},
    ],
)
@hypothesis_settings(max_examples=40)
@given(st.lists(steps, min_size=1, max_size=8))
def test_whatever_comes_only_whole_fixes_leave(settings, given_steps):
    node = geolocator(**settings)
    told = Told(node)
    sound = [Step("state", 0, None, None, None), Step("state", 20, None, None, None)]
    for step in [*sound, *given_steps, Step("state", 10, None, None, None), Step("picture", 1, None, None, None)]:
        fix = told.take(step)
        if fix is not None:
            check(fix, told)
            if fix.verdict is not FixVerdict.OUT_OF_ORDER:
                told.captured_ns.append(fix.captured_at_ns)


def test_what_is_sound_passes():
    """The property above is not empty: between nonsense, what is sound becomes a fix."""
    told = Told(geolocator())
    for step in [
        Step("state", 0, None, None, None),
        Step("state", 20, (math.nan,) * 4, None, None),
        Step("state", 0, None, None, None),
    ]:
        told.take(step)
    assert told.take(Step("picture", -5, (math.nan,) * 3, None, None)).verdict is FixVerdict.BEHIND_CAMERA
    assert told.take(Step("picture", 2, None, (0.0,) * 4, None)).verdict is FixVerdict.NOT_FINITE
    assert told.take(Step("picture", 1, None, None, [-1.0] * 36)).verdict is FixVerdict.BAD_COVARIANCE
    assert told.take(Step("picture", 1, None, None, None)).verdict is FixVerdict.ACCEPTED
    assert told.take(Step("picture", -1, None, None, None)).verdict is FixVerdict.OUT_OF_ORDER
