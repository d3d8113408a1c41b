import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from alight.markers.family import FamilyError
from alight.markers.layout import LayoutError, PlacedMarker, layout_from, read_layout, shipped_layouts
from alight.markers.print_grid import overlaps_m, print_grid, turned_whiteness
from schemas.settings.pad import PadSettings


def test_the_default_pad_is_the_paper_s_single_marker():
    layout = layout_from(PadSettings())
    assert [(marker.family, marker.id, marker.side_m) for marker in layout.markers] == [("5x5_1000", 68, 1.0)]
    assert layout.markers == read_layout("paper").markers
    np.testing.assert_allclose(
        layout.markers[0].corners_m()[:, :2], [[-0.5, 0.5], [0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]]
    )


def test_a_turned_marker_s_corners_stay_those_of_its_own_print():
    marker = PlacedMarker("4x4_50", 3, 0.2, x_m=1.0, y_m=2.0, rotation_rad=math.pi / 2)
    # Turned counter-clockwise by a quarter, its upper left corner lies at the lower left.
    np.testing.assert_allclose(marker.corners_m()[0], [0.9, 1.9, 0.0], atol=1e-12)
    np.testing.assert_allclose(marker.corners_m()[1], [0.9, 2.1, 0.0], atol=1e-12)


def test_shipped_layouts_can_all_be_read():
    sides_m = {name: layout_from(PadSettings(layout=name)).markers[0].side_m for name in shipped_layouts()}
    assert sides_m == {"charuco": 0.18, "nested": 1.0, "paper": 1.0}


def test_small_markers_lie_one_level_above_the_large_one():
    large, small = read_layout("nested").levels()
    assert [marker.id for marker in large] == [68]
    assert len(small) == len(read_layout("nested").markers) - 1


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("board_m = 1.0", "either as tables"),
        ("board_m = 'x'\n[[marker]]\nfamily='4x4_50'\nid=1\nside_m=0.1", "board_m"),
        ("board_m = 1.0\n[[marker]]\nfamily='4x4_50'\nid=50\nside_m=0.1", "markers 0 to 49, not 50"),
        ("board_m = 1.0\n[[marker]]\nfamily='4x4_51'\nid=1\nside_m=0.1", "did you mean 4x4_50"),
        ("board_m = 1.0\n[[marker]]\nfamily='4x4_50'\nid=1\nside_m=1.1", "reaches beyond the board"),
        ("board_m = 1.0\n[[marker]]\nfamily='4x4_50'\nid=1\nside_m=0.1\nsize=2", "size"),
        ("board_m = 1.0\n" + 2 * "[[marker]]\nfamily='4x4_50'\nid=1\nside_m=0.1\n", "there twice"),
        ("board_m = ", "not valid TOML"),
        ("board_m = 1.0\n[[marker]]\nfamily='4x4_50'\nid=1\nside_m=nan", "side_m"),
    ],
)
def test_a_wrong_layout_is_refused_in_one_line_that_says_why(tmp_path: Path, text, complaint):
    file = tmp_path / "pad.toml"
    file.write_text(text)
    with pytest.raises(LayoutError) as refused:
        read_layout(str(file))
    assert complaint in str(refused.value)
    assert str(file) in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_layout_that_is_not_there_names_those_that_are():
    with pytest.raises(LayoutError, match="shipped layouts are charuco, nested, paper"):
        layout_from(PadSettings(layout="nestd"))
    with pytest.raises(FamilyError):
        layout_from(PadSettings(id=1000))


def test_area_means_of_a_nested_print_are_those_of_a_fine_drawing():
    board_m, fine, coarse = 1.4, 1400, 50
    markers = (
        PlacedMarker("5x5_1000", 68, 1.05),
        PlacedMarker("4x4_50", 7, 0.15, 0.245, -0.1, math.pi / 2),
        PlacedMarker("4x4_50", 8, 0.03, 0.201, 0.3),
    )
    drawn = np.full((fine, fine), 255, np.uint8)
    for marker in markers:
        family = cv2.aruco.getPredefinedDictionary(
            {"5": cv2.aruco.DICT_5X5_1000, "4": cv2.aruco.DICT_4X4_50}[marker.family[0]]
        )
        side = round(marker.side_m * 1000)
        cells = cv2.aruco.generateImageMarker(family, marker.id, family.markerSize + 2)
        picture = cv2.resize(cells, (side, side), interpolation=cv2.INTER_NEAREST_EXACT)
        picture = np.rot90(picture, round(marker.rotation_rad / (math.pi / 2)))
        left = round((board_m / 2 + marker.x_m - marker.side_m / 2) * 1000)
        top = round((board_m / 2 - marker.y_m - marker.side_m / 2) * 1000)
        drawn[top : top + side, left : left + side] = picture
    expected = drawn.reshape(coarse, fine // coarse, coarse, fine // coarse).mean(axis=(1, 3)) / 255

    grid = print_grid(markers, board_m)
    bounds = np.linspace(0.0, board_m, coarse + 1)
    down, across = (overlaps_m(bounds, seams) * (coarse / board_m) for seams in (grid.y_m, grid.x_m))
    np.testing.assert_allclose(down @ grid.white @ across.T, expected, atol=1e-9)


def test_a_marker_askew_covers_its_own_area_and_no_more():
    marker = PlacedMarker("5x5_1000", 68, 0.5, 0.1, -0.05, math.radians(30))
    white, cover = turned_whiteness(marker, 1.0, 64)
    assert cover.sum() / 64**2 == pytest.approx(0.25, rel=2e-3)
    ink = (49 - 17) / 49
    assert (cover - white).sum() / cover.sum() == pytest.approx(ink, rel=3e-3)
    upright, _ = turned_whiteness(PlacedMarker("5x5_1000", 68, 1.0), 1.0, 70)
    grid = print_grid((PlacedMarker("5x5_1000", 68, 1.0),), 1.0)
    np.testing.assert_allclose(upright, np.kron(grid.white, np.ones((10, 10))))
