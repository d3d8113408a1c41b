import io

import pytest

from station.count_progress import CountProgress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("total", [7, 200])
def test_a_log_gets_some_lines_of_text_the_last_of_which_tells_the_whole(total) -> None:
    stream = io.StringIO()
    progress = CountProgress("compared", total, stream)
    for done in range(1, total + 1):
        progress.show(done)
    lines = stream.getvalue().splitlines()
    assert 5 <= len(lines) <= 11 and "\r" not in stream.getvalue()
    assert lines[-1] == f"{total} of {total} compared"


def test_a_terminal_shows_every_count_in_one_line_that_ends_when_all_is_done() -> None:
    stream = Terminal()
    progress = CountProgress("compared", 3, stream)
    for done in range(1, 4):
        progress.show(done)
    assert stream.getvalue().count("\r") == 3 and stream.getvalue().count("\n") == 1
    assert "2 of 3 compared" in stream.getvalue()


def test_of_a_number_that_is_not_known_each_is_told() -> None:
    stream = io.StringIO()
    CountProgress("hovers flown", stream=stream).show(4)
    assert stream.getvalue() == "4 hovers flown\n"
