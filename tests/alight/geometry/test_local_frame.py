"""A frame at a fixed origin agrees with the functions that take the origin each time."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from alight.geometry.local import moved_by_ned, ned_between
from alight.geometry.local_frame import LocalFrame
from schemas.message import GlobalPosition

lengths = st.floats(-2000.0, 2000.0)
places = st.builds(
    lambda latitude, longitude, height: GlobalPosition(
        latitude_deg=latitude, longitude_deg=longitude, altitude_amsl_m=height - 40.0, ellipsoidal_height_m=height
    ),
    st.floats(-90.0, 90.0),
    st.floats(-180.0, 180.0),
    st.floats(-100.0, 5000.0),
)


@given(places, st.tuples(lengths, lengths, lengths))
def test_there_and_back(origin, ned_m):
    frame = LocalFrame(origin)
    point = frame.point_at(*ned_m)
    np.testing.assert_allclose(ned_between(origin, moved_by_ned(origin, ned_m)), frame.ned_of(point), atol=1e-7)
    np.testing.assert_allclose(frame.ned_of(point), ned_m, atol=1e-6)
    np.testing.assert_allclose(frame.ned_of(point), ned_between(origin, point), atol=1e-7)
