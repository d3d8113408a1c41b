import numpy as np

from station.train_yolo.crops import BEYOND, CROP_PX, crops_from
from station.train_yolo.frames import Frame


def frame_with_a_square(left: int, top: int, side: int) -> Frame:
    picture = np.full((480, 640), BEYOND, np.uint8)
    picture[top : top + side, left : left + side] = 255
    return Frame(picture, (left + side / 2 - 0.5, top + side / 2 - 0.5), float(side))


def test_the_marker_is_where_the_crop_says_at_every_scale_and_at_the_pictures_edge() -> None:
    draw = np.random.default_rng(3)
    sides = set()
    for left, top in ((304, 200), (0, 0), (608, 448), (80, 440)):
        for picture, marker in crops_from(frame_with_a_square(left, top, 32), draw):
            assert picture.shape == (CROP_PX, CROP_PX)
            rows, columns = np.nonzero(picture > BEYOND)
            whole = len(rows) and min(rows.min(), columns.min()) > 0 and max(rows.max(), columns.max()) < CROP_PX - 1
            if whole:
                assert np.allclose(marker[:2], (columns.mean(), rows.mean()))
                sides.add(float(marker[2]))
            if len(rows) == 0:
                assert np.isnan(marker).all()
    assert sides >= {4.0, 8.0, 16.0, 32.0}


def test_a_frame_without_a_marker_gives_crops_without() -> None:
    nothing = Frame(np.full((480, 640), 90, np.uint8), (np.nan, np.nan), np.nan)
    assert all(np.isnan(marker).all() for _, marker in crops_from(nothing, np.random.default_rng(1)))
