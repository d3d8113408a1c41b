import numpy as np
import pytest

from alight.geometry.local import moved_by_ned
from alight.geometry.rotation import R_from_quaternion, quaternion_from_euler
from schemas.estimate import PadEstimate
from schemas.message import GlobalPosition
from schemas.settings.geolocator import Mount
from schemas.vehicle import UNKNOWN_ROTATION, GimbalState, LandedState, VehicleState, VehicleStatus
from services.detector.prior import PriorKeeper

PAD = GlobalPosition(latitude_deg=47.4, longitude_deg=8.5, altitude_amsl_m=500.0, ellipsoidal_height_m=500.0)
NOW_NS = 1_000_000_000_000
MS = 1_000_000


def state(at_ns: int, from_pad_m=(3.0, -2.0, -20.0), yaw=0.5, **more) -> VehicleState:
    fields = {"velocity_ned_mps": (0.0, 0.0, 0.0), "angular_velocity_body_rps": (0.0, 0.0, 0.0), **more}
    return VehicleState(
        at_ns=at_ns, position=moved_by_ned(PAD, from_pad_m), q_ned_body=quaternion_from_euler(0.05, -0.1, yaw), **fields
    )


def estimate(captured_at_ns: int, sigma_m: float = 0.1) -> PadEstimate:
    variance = sigma_m**2
    return PadEstimate(
        captured_at_ns=captured_at_ns,
        position=PAD,
        pad_ned_m=(-3.0, 2.0, 20.0),
        azimuth_rad=0.3,
        covariance_ned_m2=(variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance),
        azimuth_variance_rad2=0.01,
        method="test",
        fixes_used=1,
    )


@pytest.fixture
def keeper() -> PriorKeeper:
    keeper = PriorKeeper(Mount())
    keeper.add_state(state(NOW_NS - 20 * MS))
    keeper.add_state(state(NOW_NS + 20 * MS))
    return keeper


def test_without_an_estimate_only_the_attitude_is_known(keeper, studio) -> None:
    prior = keeper.at(NOW_NS, studio.camera)
    assert prior.height_m is None
    assert prior.centre_px is None
    down_camera = R_from_quaternion(prior.q_ned_camera)[2]
    assert down_camera[2] == pytest.approx(np.cos(0.05) * np.cos(0.1), abs=1e-6)


def test_with_an_estimate_height_place_and_azimuth_are_known(keeper, studio, truth_at) -> None:
    keeper.add_estimate(estimate(NOW_NS - 100 * MS))
    prior = keeper.at(NOW_NS, studio.camera)
    shot = studio.shoot(3.0, -2.0, -20.0, (0.05, -0.1, 0.5))
    assert prior.height_m == pytest.approx(19.9, abs=0.02)
    assert np.allclose(prior.centre_px, studio.camera.project(shot.centre_camera_m[None])[0], atol=0.2)
    assert prior.azimuth_rad == pytest.approx(0.3)
    assert prior.centre_sigma_px > 3.0


@pytest.mark.parametrize("at_ns", [NOW_NS + 400 * MS, NOW_NS - 500 * MS])
def test_without_a_pose_near_the_capture_nothing_is_known(keeper, studio, at_ns) -> None:
    assert keeper.at(at_ns, studio.camera) is None


def test_an_old_or_vague_estimate_tells_no_place(keeper, studio) -> None:
    for each in (estimate(NOW_NS - 5_000 * MS), estimate(NOW_NS + 900 * MS), estimate(NOW_NS - MS, sigma_m=30.0)):
        keeper.add_estimate(each)
        assert keeper.at(NOW_NS, studio.camera).height_m is None


def test_a_pad_that_would_be_above_the_vehicle_tells_no_place(studio) -> None:
    keeper = PriorKeeper(Mount())
    keeper.add_state(state(NOW_NS, (0.0, 0.0, 5.0)))
    keeper.add_estimate(estimate(NOW_NS - MS))
    assert keeper.at(NOW_NS, studio.camera).height_m is None


def test_an_estimate_too_vague_for_a_height_still_says_how_high_the_camera_hardly_is(studio) -> None:
    keeper = PriorKeeper(Mount())
    keeper.add_state(state(NOW_NS, (0.0, 0.0, -0.5)))
    keeper.add_estimate(estimate(NOW_NS - 100 * MS))
    prior = keeper.at(NOW_NS, studio.camera)
    assert prior.height_m is None
    assert 0.5 < prior.height_at_most_m < 1.5
    keeper.add_estimate(estimate(NOW_NS - 9_000 * MS))
    assert keeper.at(NOW_NS, studio.camera).height_at_most_m > 5.0


def test_a_vehicle_on_the_ground_is_no_higher_than_it_stands_while_the_autopilot_says_so(keeper, studio) -> None:
    keeper.add_estimate(estimate(NOW_NS - 100 * MS))
    standing = {"landed_state": LandedState.ON_GROUND}
    keeper.add_status(VehicleStatus(at_ns=NOW_NS - 100 * MS, connected=True, **standing))
    assert keeper.at(NOW_NS, studio.camera).height_at_most_m < 1.0
    for status in (
        VehicleStatus(at_ns=NOW_NS - 5_000 * MS, connected=True, **standing),
        VehicleStatus(at_ns=NOW_NS, connected=False, **standing),
        VehicleStatus(at_ns=NOW_NS, connected=True, landed_state=LandedState.IN_AIR),
    ):
        keeper.add_status(status)
        assert keeper.at(NOW_NS, studio.camera).height_m == pytest.approx(19.9, abs=0.02)


def test_a_gimbal_that_fell_silent_is_no_fixed_mount(keeper, studio) -> None:
    q = quaternion_from_euler(0.0, -1.2, 0.0)
    keeper.add_gimbal(GimbalState(at_ns=NOW_NS - 2_000 * MS, q_body_gimbal=q, measured=True))
    assert keeper.at(NOW_NS, studio.camera) is None
    keeper.add_gimbal(GimbalState(at_ns=NOW_NS, q_body_gimbal=q, measured=True))
    assert keeper.at(NOW_NS, studio.camera) is not None
    keeper.add_gimbal(GimbalState(at_ns=NOW_NS, q_body_gimbal=UNKNOWN_ROTATION, measured=True))
    assert keeper.at(NOW_NS, studio.camera) is None


def test_between_poses_the_attitude_is_that_of_the_moment(studio) -> None:
    keeper = PriorKeeper(Mount())
    keeper.add_state(state(NOW_NS - 50 * MS, yaw=0.0))
    keeper.add_state(state(NOW_NS + 50 * MS, yaw=0.2))
    forward = R_from_quaternion(keeper.at(NOW_NS, studio.camera).q_ned_camera)[:, 1]
    # Image down is backward.
    assert np.arctan2(-forward[1], -forward[0]) == pytest.approx(0.1, abs=0.01)
