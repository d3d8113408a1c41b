"""The pad as a PDF at true scale: a page that says how, then a page for each sheet."""

from pathlib import Path

from fpdf import FPDF
from fpdf.drawing import DrawingContext, PaintedPath

from alight.markers.layout import PadLayout
from station.pad.outline import Loop, ink_loops_m
from station.pad.tiling import FOOT_MM, MARGIN_MM, Tile, Tiling

SCALE_BAR_MM = 100.0
"""Length of the bar that every page carries."""

_MARK_MM = 8.0
_MARK_GAP_MM = 1.0
_THIN_MM, _BAR_MM = 0.15, 1.2
_MAP_MM = 20.0
_DRAWING_MM = 95.0
_BLACK, _WHITE, _GREY = "#000000", "#ffffff", "#d0d0d0"


def write_pdf(layout: PadLayout, cut: Tiling, paper: str, file: Path) -> None:
    """Write the pages.

    Args:
        layout: What to print.
        cut: How it is cut into sheets.
        paper: Name of the paper, for people.
        file: Where to write.
    """
    pdf = FPDF(unit="mm", format=cut.page_mm)
    pdf.set_auto_page_break(False)
    pdf.set_margin(MARGIN_MM)
    pdf.set_title(f"Pad {layout.name}")
    pdf.set_creator("Alight")
    _cover(pdf, layout, cut, paper)
    for tile in cut.tiles:
        _sheet(pdf, layout, cut, tile)
    pdf.output(str(file))


def hints(layout: PadLayout, cut: Tiling, paper: str) -> list[str]:
    """What to heed when printing and laying out."""
    sheets = len(cut.tiles)
    smallest = min(marker.side_m for marker in layout.markers)
    return [
        f"Print pages 2 to {sheets + 1} on {paper} at 100 % ('actual size', never 'fit to page'). Then measure the bar on each: "
        f"it must be {SCALE_BAR_MM:g} mm long, to half a millimetre. If it is not, set side_m to what came out.",
        "Use matt paper and matt film: what shines mirrors the sun, and a marker under a highlight cannot be read. "
        "Black must be black in the infrared, too, if the camera has no filter: laser toner is, some inks are not.",
        "Cut at the marks left and above; leave the strips at the right and below, and lay the next sheet over them."
        if sheets > 1
        else "Cut at the marks.",
        f"Glue it flat onto a stiff board of {1000 * layout.board_m:.0f} mm: a bulge of 1 % of a marker's side already tilts its pose.",
        f"Keep the white margin free and clean; beside the smallest marker it is {1000 * smallest / 7.0:.0f} mm that matter. "
        "Let no edge of a shadow lie across the pad at the hour of landing, and no lamp mirror in it.",
        "The arrow points up in the print: the vehicle's nose turns that way. Let it point where the legs should stand.",
    ]


def _cover(pdf: FPDF, layout: PadLayout, cut: Tiling, paper: str) -> None:
    pdf.add_page()
    width_mm = pdf.w - 2.0 * MARGIN_MM
    pdf.set_font("Helvetica", "B", 15)
    pdf.multi_cell(width_mm, 8, f"Pad {Path(layout.name).stem}", align="L", new_x="LMARGIN", new_y="NEXT")
    pdf.set_font("Helvetica", "", 9)
    parts = ", ".join(f"{m.family} {m.id} ({1000 * m.side_m:g} mm)" for m in layout.markers)
    summary = f"{cut.rows} x {cut.columns} sheets, board {1000 * layout.board_m:g} mm. Markers (side of the black edge): {parts}."
    pdf.multi_cell(width_mm, 4.2, summary, align="L", new_x="LMARGIN", new_y="NEXT")
    pdf.ln(1.5)
    for number, hint in enumerate(hints(layout, cut, paper), 1):
        pdf.multi_cell(width_mm, 4.2, f"{number}. {hint}", align="L", new_x="LMARGIN", new_y="NEXT")
    top_mm = pdf.get_y() + 5.0
    edge_mm = min(_DRAWING_MM, width_mm, pdf.h - MARGIN_MM - FOOT_MM - top_mm)
    _draw_map(pdf, layout, cut, (MARGIN_MM, top_mm), edge_mm)
    _scale_bar(pdf)


def _draw_map(pdf: FPDF, layout: PadLayout, cut: Tiling, place_mm: tuple[float, float], edge_mm: float) -> None:
    """The whole board in small, with the cuts, the sheets' numbers, and the arrow."""
    scale = edge_mm / (1000.0 * layout.board_m)
    left_mm, top_mm = place_mm
    _draw_print(pdf, layout, scale, (left_mm, top_mm))
    pdf.set_draw_color(200, 0, 0)
    pdf.set_text_color(200, 0, 0)
    pdf.set_line_width(_THIN_MM)
    pdf.set_font("Helvetica", "", 8)
    for number, tile in enumerate(cut.tiles, 2):
        x_mm, y_mm = left_mm + scale * tile.left_mm, top_mm + scale * tile.top_mm
        pdf.rect(x_mm, y_mm, scale * tile.width_mm, scale * tile.height_mm)
        pdf.text(x_mm + 1.0, y_mm + 3.5, str(number))
    pdf.set_draw_color(0)
    pdf.set_text_color(0)
    middle_mm = left_mm + edge_mm + 8.0
    if middle_mm < pdf.w - MARGIN_MM:
        with pdf.drawing_context() as context:
            tip, foot = (middle_mm, top_mm), top_mm + 25.0
            _fill(context, [[tip, (middle_mm - 3.0, top_mm + 8.0), (middle_mm + 3.0, top_mm + 8.0)]], _BLACK)
            _fill(context, [_box(middle_mm - 0.6, top_mm + 8.0, 1.2, foot - top_mm - 8.0)], _BLACK)
        pdf.text(middle_mm - 2.0, foot + 4.0, "up")


def _sheet(pdf: FPDF, layout: PadLayout, cut: Tiling, tile: Tile) -> None:
    pdf.add_page()
    wide_mm, high_mm = tile.width_mm + tile.spare_right_mm, tile.height_mm + tile.spare_below_mm
    with pdf.rect_clip(MARGIN_MM, MARGIN_MM, wide_mm, high_mm):
        _draw_print(pdf, layout, 1.0, (MARGIN_MM - tile.left_mm, MARGIN_MM - tile.top_mm))
    _cut_marks(pdf, tile)
    _page_map(pdf, cut, tile)
    _scale_bar(pdf)
    pdf.set_font("Helvetica", "", 8)
    text = f"Pad {Path(layout.name).stem}, row {tile.row + 1} of {cut.rows}, column {tile.column + 1} of {cut.columns}"
    pdf.text(MARGIN_MM, pdf.h - MARGIN_MM - 12.0, text)


def _draw_print(pdf: FPDF, layout: PadLayout, scale: float, place_mm: tuple[float, float]) -> None:
    """The board at a scale, its upper left corner at a place."""
    half_m = layout.board_m / 2.0

    def on_page(loop: Loop) -> list[tuple[float, float]]:
        return [
            (place_mm[0] + 1000.0 * scale * (x + half_m), place_mm[1] + 1000.0 * scale * (half_m - y))
            for x, y in loop.tolist()
        ]

    with pdf.drawing_context() as context:
        for square in layout.ink:
            _fill(context, [on_page(square.outline_m())], _BLACK)
        for marker in layout.markers:
            _fill(context, [on_page(marker.corners_m()[:, :2])], _WHITE)
            _fill(context, [on_page(loop) for loop in ink_loops_m(marker)], _BLACK)


def _cut_marks(pdf: FPDF, tile: Tile) -> None:
    """At the corners of what is kept, outside of it; the board's own outline is cut there, too."""
    pdf.set_line_width(_THIN_MM)
    right_mm, below_mm = MARGIN_MM + tile.width_mm, MARGIN_MM + tile.height_mm
    far_right_mm, far_below_mm = right_mm + tile.spare_right_mm, below_mm + tile.spare_below_mm
    for x_mm in (MARGIN_MM, right_mm):
        pdf.line(x_mm, MARGIN_MM - _MARK_GAP_MM - _MARK_MM, x_mm, MARGIN_MM - _MARK_GAP_MM)
        pdf.line(x_mm, far_below_mm + _MARK_GAP_MM, x_mm, far_below_mm + _MARK_GAP_MM + _MARK_MM)
    for y_mm in (MARGIN_MM, below_mm):
        pdf.line(MARGIN_MM - _MARK_GAP_MM - _MARK_MM, y_mm, MARGIN_MM - _MARK_GAP_MM, y_mm)
        pdf.line(far_right_mm + _MARK_GAP_MM, y_mm, far_right_mm + _MARK_GAP_MM + _MARK_MM, y_mm)


def _page_map(pdf: FPDF, cut: Tiling, here: Tile) -> None:
    cell_mm = min(_MAP_MM / cut.columns, (FOOT_MM - 5.0) / cut.rows)
    left_mm, top_mm = pdf.w - MARGIN_MM - cut.columns * cell_mm, pdf.h - MARGIN_MM - cut.rows * cell_mm
    pdf.set_line_width(_THIN_MM)
    for tile in cut.tiles:
        pdf.set_fill_color(90 if tile is here else 255)
        pdf.rect(left_mm + tile.column * cell_mm, top_mm + tile.row * cell_mm, cell_mm, cell_mm, style="DF")


def _scale_bar(pdf: FPDF) -> None:
    """A bar with a tick every ten millimetres, at the lower left."""
    left_mm, top_mm = MARGIN_MM, pdf.h - MARGIN_MM - 5.0
    with pdf.drawing_context() as context:
        _fill(context, [_box(left_mm, top_mm, SCALE_BAR_MM, _BAR_MM)], _BLACK)
        for step in range(11):
            x_mm = left_mm + step * SCALE_BAR_MM / 10.0
            _fill(context, [_box(x_mm - _THIN_MM / 2.0, top_mm - 2.0, _THIN_MM, 2.0)], _BLACK)
    pdf.set_font("Helvetica", "", 8)
    pdf.text(left_mm, top_mm + 5.0, f"This bar must be {SCALE_BAR_MM:g} mm long.")


def _box(left_mm: float, top_mm: float, width_mm: float, height_mm: float) -> list[tuple[float, float]]:
    right_mm, below_mm = left_mm + width_mm, top_mm + height_mm
    return [(left_mm, top_mm), (right_mm, top_mm), (right_mm, below_mm), (left_mm, below_mm)]


def _fill(context: DrawingContext, loops: list[list[tuple[float, float]]], colour: str) -> None:
    path = PaintedPath()
    for loop in loops:
        path.move_to(*loop[0])
        for corner in loop[1:]:
            path.line_to(*corner)
        path.close()
    path.style.fill_color = colour
    path.style.stroke_color = None
    path.style.intersection_rule = "evenodd"
    path.style.paint_rule = "fill_evenodd"
    context.add_item(path)
