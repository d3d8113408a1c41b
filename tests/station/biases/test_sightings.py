"""Several recordings put together as one."""

import numpy as np

from station.biases.sightings import Sightings, Track, together

SQUARE = np.array([[-0.5, 0.5, 0.0], [0.5, 0.5, 0.0], [0.5, -0.5, 0.0], [-0.5, -0.5, 0.0]])


def recording(seed, begin_s, frames):
    random = np.random.default_rng(seed)
    times_s = begin_s + np.sort(random.uniform(0.0, 20.0, 50))
    position, attitude = Track(times_s, random.normal(size=(50, 3))), Track(times_s[:-3], random.normal(size=(47, 4)))
    captured_s = begin_s + np.sort(random.uniform(0.0, 20.0, frames))
    return Sightings(captured_s, random.normal(size=(frames, 4, 2)), SQUARE * seed, position, attitude)


def test_each_frame_keeps_its_pose_its_corners_and_its_print_whatever_the_latency():
    recordings = [recording(1, 0.0, 7), recording(2, 500.0, 4), recording(3, -3.0, 9)]
    for latency_s in (-5.0, 0.0, 0.3, 60.0):
        whole, first = together(recordings), 0
        at_s = whole.captured_s - latency_s
        for one in recordings:
            mine = slice(first, first + len(one))
            for joined, track in ((whole.position, one.position), (whole.attitude, one.attitude)):
                np.testing.assert_allclose(joined.at(at_s)[mine], track.at(one.captured_s - latency_s), atol=1e-9)
            np.testing.assert_array_equal(whole.corners_px[mine], one.corners_px)
            np.testing.assert_array_equal(whole.corners_m[mine], np.broadcast_to(one.corners_m, (len(one), 4, 3)))
            first += len(one)
        assert first == len(whole)
