"""One picture of a page, drawn twice: for a broad page and paper, and for a phone."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from matplotlib.figure import Figure

from station.report.svg import figure, inline_svg

Draw = Callable[[Figure, bool], None]
"""Fills a figure; the flag says whether it is the narrow one."""

BROAD_IN, NARROW_IN = 10.8, 4.3


@dataclass(frozen=True)
class Picture:
    """What to draw, and how large."""

    name: str
    """Unique on its page."""
    title: str
    """For who cannot see it."""
    broad_height_in: float
    narrow_height_in: float
    draw: Draw

    @contextmanager
    def drawn(self, *, narrow: bool) -> Iterator[Figure]:
        """The filled figure of one width, in the page's style."""
        width_in, height_in = (NARROW_IN, self.narrow_height_in) if narrow else (BROAD_IN, self.broad_height_in)
        with figure(width_in, height_in, f"{self.name}.{'narrow' if narrow else 'broad'}") as filled:
            self.draw(filled, narrow)
            yield filled

    def html(self) -> str:
        """Both as one element; the page's style shows the one that fits."""
        parts = []
        for narrow, kind in ((False, "broad"), (True, "narrow")):
            with self.drawn(narrow=narrow) as filled:
                parts.append(f'<div class="{kind}">{inline_svg(filled, self.title, f"{self.name}-{kind}")}</div>')
        return f'<figure class="plot">{"".join(parts)}</figure>'
