"""Box plots in the house's colours."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from station.report.figures.static_records import Array
from station.report.palette import LIGHT


def whiskers(axes: Axes, samples: Sequence[Array], names: Sequence[str]) -> None:
    """One box a sample: quartiles, median as a line, mean as a triangle; whiskers at 1.5 times the quartiles' distance."""
    axes.boxplot(
        list(samples),
        whis=1.5,
        widths=0.5,
        showmeans=True,
        showfliers=False,
        patch_artist=True,
        boxprops={"facecolor": LIGHT.faint, "edgecolor": LIGHT.ink, "linewidth": 0.8},
        whiskerprops={"color": LIGHT.ink, "linewidth": 0.8},
        capprops={"color": LIGHT.ink, "linewidth": 0.8},
        medianprops={"color": LIGHT.setpoint, "linewidth": 1.4},
        meanprops={"marker": "^", "markerfacecolor": LIGHT.corrected, "markeredgecolor": "none", "markersize": 5},
    )
    axes.set_xticks(range(1, len(names) + 1), names)
    axes.axhline(0, color=LIGHT.muted, linewidth=0.7)
    axes.grid(visible=False, axis="x")
