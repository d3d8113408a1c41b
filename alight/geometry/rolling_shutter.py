"""When the rows of a picture were exposed."""


def row_after_s(row_px: float, height_px: int, row_time_s: float) -> float:
    """From the exposure of the middle row to that of another, seconds.

    Args:
        row_px: The row; 0 is the middle of the uppermost one.
        height_px: Rows of the picture.
        row_time_s: From one row to the row below it, seconds.
    """
    if row_time_s == 0.0:
        return 0.0
    return row_time_s * (row_px - (height_px - 1) / 2.0)
