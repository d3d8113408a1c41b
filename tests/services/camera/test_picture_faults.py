"""Pictures that are lost or come shifted, as often as asked for and the same for the same seed."""

import numpy as np
import pytest

from schemas.settings.camera import CameraFaults
from services.camera.picture_faults import PictureFaults

PICTURE = np.zeros((120, 160), np.uint8)
PICTURE[40:60, 50:80] = 255


def fates(seed=1, count=2000, **faults):
    source = PictureFaults(CameraFaults(**faults), np.random.default_rng(seed))
    return [source.applied(PICTURE) for _ in range(count)]


def test_without_faults_every_picture_comes_as_it_is():
    assert all(picture is PICTURE for picture in fates(count=50))


def test_faults_come_as_often_as_asked_for():
    seen = fates(drop_fraction=0.1, jump_fraction=0.02)
    dropped = sum(picture is None for picture in seen)
    shifted = sum(picture is not None and picture is not PICTURE for picture in seen)
    # Four standard deviations of a binomial count.
    assert dropped == pytest.approx(200, abs=54) and shifted == pytest.approx(36, abs=24)


def test_a_shifted_picture_is_off_by_at_least_half_of_the_largest_shift():
    jumped = [picture for picture in fates(count=40, jump_fraction=1.0, jump_px=30.0) if picture is not None]
    rows, columns = np.indices(PICTURE.shape)
    for picture in jumped:
        weight = picture.astype(float)
        moved = (
            float((weight * columns).sum() / weight.sum()) - 64.5,
            float((weight * rows).sum() / weight.sum()) - 49.5,
        )
        assert 14.5 < np.hypot(*moved) < 30.5


def test_one_fault_leaves_the_others_where_they_were():
    alone = [picture is None for picture in fates(count=200, drop_fraction=0.1)]
    both = [picture is None for picture in fates(count=200, drop_fraction=0.1, jump_fraction=0.5)]
    assert alone == both
