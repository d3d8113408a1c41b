"""The PDF, read back as a printer would: lengths are measured and markers decoded on the rasterised pages."""

import cv2
import numpy as np
import pypdfium2
import pytest

from alight.markers.family import dictionary
from alight.markers.layout import read_layout
from station.__main__ import main
from station.pad.drawing import whiteness
from station.pad.outline import ink_loops_m
from station.pad.tiling import MARGIN_MM, PAPERS_MM, tiling

PX_PER_MM = 2.0
SMALL = """
board_m = 0.18

[[marker]]
family = "4x4_50"
id = 7
side_m = 0.12

[[marker]]
family = "4x4_50"
id = 9
side_m = 0.018
x_m = 0.076
y_m = 0.076
rotation_rad = 0.3
"""


def pages(file):
    """The pages as pictures of `PX_PER_MM`. The program that draws them fits a page to whole pixels, hence the resizing."""
    pictures = []
    for page in pypdfium2.PdfDocument(str(file)):
        size = tuple(round(PX_PER_MM * points * 25.4 / 72.0) for points in page.get_size())
        drawn = np.asarray(page.render(scale=PX_PER_MM * 25.4 / 72.0).to_pil().convert("L"))
        pictures.append(cv2.resize(drawn, size, interpolation=cv2.INTER_LINEAR))
    return pictures


def printed(tmp_path, layout, *options):
    out = tmp_path / "pad.pdf"
    assert main(["pad", "print", str(layout), "--out", str(out), *options]) == 0
    return pages(out)


def longest_run_px(row):
    dark = np.flatnonzero(np.diff(np.concatenate(([False], row < 128, [False])).astype(int)))
    return max((end - start for start, end in zip(dark[::2], dark[1::2], strict=True)), default=0)


def assembled(sheets, cut):
    """The board glued together from what is kept of each sheet."""
    board_px = round(PX_PER_MM * (cut.tiles[-1].left_mm + cut.tiles[-1].width_mm))
    board = np.full((board_px, board_px), 77, np.uint8)
    for sheet, tile in zip(sheets, cut.tiles, strict=True):
        left, top = round(PX_PER_MM * tile.left_mm), round(PX_PER_MM * tile.top_mm)
        right, below = (
            round(PX_PER_MM * (tile.left_mm + tile.width_mm)),
            round(PX_PER_MM * (tile.top_mm + tile.height_mm)),
        )
        first = round(PX_PER_MM * MARGIN_MM)
        board[top:below, left:right] = sheet[first : first + below - top, first : first + right - left]
    return board


def test_the_scale_bar_of_every_page_is_as_long_as_it_says(tmp_path):
    for page in printed(tmp_path, "nested", "--paper", "A1"):
        foot = page[-round(PX_PER_MM * 20) :, : round(PX_PER_MM * 125)]
        assert max(longest_run_px(row) for row in foot) / PX_PER_MM == pytest.approx(100.0, abs=0.5)


@pytest.mark.parametrize("paper", ["A0", "A4"])
def test_the_sheets_glued_together_are_the_pad(tmp_path, paper):
    nested = read_layout("nested")
    _, *sheets = printed(tmp_path, "nested", "--paper", paper)
    cut = tiling(1300.0, paper, 10.0)
    assert len(sheets) == len(cut.tiles)
    board = assembled(sheets, cut)

    # An edge may lie a pixel off where a sheet begins at a part of one.
    expected = 255 * whiteness(nested, board.shape[0])
    assert np.mean(np.abs(board - expected) > 128) < 0.01
    large, small = nested.levels()
    assert len(decoded(board, small)) == len(small)
    from_afar = cv2.resize(board, None, fx=0.1, fy=0.1, interpolation=cv2.INTER_AREA)
    assert len(decoded(from_afar, large)) == 1


def decoded(picture, markers):
    """Corners of those of the markers that can be read; OpenCV reads no marker around others that it can read."""
    numbers = [marker.id for marker in markers]
    codes = dictionary(markers[0].family)
    codes = cv2.aruco.Dictionary(codes.bytesList[numbers], codes.markerSize, codes.maxCorrectionBits)
    parameters = cv2.aruco.DetectorParameters()
    parameters.minMarkerPerimeterRate = 0.01
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    corners, ids, _ = cv2.aruco.ArucoDetector(codes, parameters).detectMarkers(np.ascontiguousarray(picture))
    return {numbers[i]: c.reshape(4, 2) for i, c in zip(np.ravel(ids).astype(int), corners, strict=True)}


def test_a_pad_that_fits_on_a_sheet_is_printed_at_true_size_askew_markers_and_all(tmp_path):
    file = tmp_path / "small.toml"
    file.write_text(SMALL)
    _, sheet = printed(tmp_path, file, "--paper", "A4")
    markers = read_layout(str(file)).markers
    found = decoded(sheet, markers)
    for marker in markers:
        on_sheet_mm = (marker.corners_m()[:, :2] * (1, -1) + 0.09) * 1000 + MARGIN_MM
        assert np.abs((found[marker.id] + 0.5) / PX_PER_MM - on_sheet_mm).max() < 0.3


def test_neighbouring_sheets_share_a_strip_to_be_glued_on():
    cut = tiling(1300.0, "A4", 10.0)
    for tile in cut.tiles:
        assert tile.spare_right_mm == pytest.approx(10.0 if tile.column < cut.columns - 1 else 0.0)
        assert tile.width_mm + tile.spare_right_mm <= cut.page_mm[0] - 2 * MARGIN_MM
    assert sum(tile.width_mm for tile in cut.tiles if tile.row == 0) == pytest.approx(1300.0)
    assert set(cut.page_mm) == set(PAPERS_MM["A4"])


def test_ink_is_outlined_without_seams():
    marker = read_layout("paper").markers[0]
    loops = ink_loops_m(marker)
    area_m2 = sum(abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2 * sign for (x, y), sign in signed(loops))
    assert area_m2 == pytest.approx(32 / 49)


def signed(loops):
    """Lines that run the other way round enclose what is no ink."""
    for loop in loops:
        x, y = loop.T
        yield (x, y), -np.sign(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["print", "nestd", "--out", "x.pdf"], "shipped layouts are"),
        (["print", "nested", "--paper", "A4", "--overlap-mm", "90", "--out", "x.pdf"], "leaves nothing"),
        (["print", "nested", "--out", "/nowhere/x.pdf"], "/nowhere/x.pdf"),
        (["show", "nested", "--out", "/nowhere/x.png"], "/nowhere/x.png"),
    ],
)
def test_wrong_use_is_refused_in_a_line(tmp_path, monkeypatch, capsys, words, complaint):
    monkeypatch.chdir(tmp_path)
    assert main(["pad", *words]) == 2
    error = capsys.readouterr().err
    assert complaint in error
    assert error.count("\n") == 1


def test_show_lists_the_markers_and_draws_them(tmp_path, capsys):
    out = tmp_path / "pad.png"
    assert main(["pad", "show", "nested", "--out", str(out)]) == 0
    assert "15 markers on a board of 1.3 m" in capsys.readouterr().out
    drawn = cv2.imread(str(out), cv2.IMREAD_GRAYSCALE)
    assert 93 in decoded(drawn, read_layout("nested").markers[1:])
