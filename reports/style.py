"""One look for all figures: colours for light and dark pages, sizes, and matplotlib's settings.

Figures are drawn in the light colours, so that they stand on their own in a notebook or a talk; in a page
each colour becomes a CSS variable (`reports.svg`), and the page chooses.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import wraps
from typing import Any, NamedTuple, ParamSpec

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure


class Ink(NamedTuple):
    """A colour on light and on dark ground. No two share a light colour: it tells them apart."""

    light: str
    dark: str


INKS: dict[str, Ink] = {
    "ink": Ink("#1c2127", "#eceff3"),
    "muted": Ink("#626b77", "#9ea8b4"),
    "faint": Ink("#d3d9df", "#3c444e"),
    "shade": Ink("#eceff2", "#262c34"),
    "surface": Ink("#ffffff", "#14181d"),
    "twin": Ink("#0a6ebd", "#5cb3f5"),
    "ebt": Ink("#b65006", "#f5a65b"),
    "ebt-large": Ink("#a3348b", "#e893d6"),
    "ebt-smoothed": Ink("#1b7f5c", "#63d2a6"),
    "gap": Ink("#c2352b", "#ff8a7a"),
    "warn": Ink("#9a6200", "#f2c14e"),
    "warn-ground": Ink("#fff6e0", "#2e2716"),
    "flag-merged": Ink("#7b3fa0", "#c792ea"),
    "flag-frozen": Ink("#00798c", "#4dd0e1"),
    "flag-jump": Ink("#d08700", "#ffd54f"),
    "flag-segment": Ink("#b8332b", "#ff8a80"),
    "flag-gap": Ink("#8a94a0", "#6f7a86"),
    "flag-other": Ink("#5d7a3a", "#aed581"),
}
"""Every colour of figures and pages, by the name of its CSS variable."""

INK, MUTED, FAINT, SHADE, SURFACE, TWIN, WARN = (
    INKS[name].light for name in ("ink", "muted", "faint", "shade", "surface", "twin", "warn")
)
EBT, EBT_LARGE, EBT_SMOOTHED = (INKS[name].light for name in ("ebt", "ebt-large", "ebt-smoothed"))
GAP = INKS["gap"].light

HALF_WIDTH_IN, FULL_WIDTH_IN = 4.2, 8.7  # of figures that share a row, and of those that fill it

_SETTINGS: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.facecolor": "none",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": FAINT,
    "grid.linewidth": 0.5,
    "axes.unicode_minus": True,
    "figure.facecolor": "none",
    "text.color": INK,
    "text.parse_math": False,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "legend.handlelength": 1.6,
    "legend.columnspacing": 1.4,
    "legend.borderaxespad": 0.0,
    "lines.linewidth": 1.4,
    "hatch.linewidth": 0.5,
    "path.simplify_threshold": 0.3,
    "svg.fonttype": "none",
    "svg.hashsalt": "swimcal",
    "savefig.facecolor": "none",
}

P = ParamSpec("P")


def applied() -> AbstractContextManager[None]:
    """The settings, for as long as the block lasts."""
    return matplotlib.rc_context(rc=_SETTINGS)  # type: ignore[arg-type]


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """A function that draws a figure, under the settings."""

    @wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with applied():
            return draw(*args, **kwargs)

    return drawn


class Margins(NamedTuple):
    """Space around a panel, inches."""

    left: float = 0.60
    right: float = 0.10
    bottom: float = 0.42
    top: float = 0.34


MARGINS = Margins()


def panel(width_in: float, height_in: float, margins: Margins = MARGINS) -> tuple[Figure, Axes]:
    """A figure with one panel within fixed margins, which costs less than any automatic layout."""
    figure = Figure(figsize=(width_in, height_in))
    return figure, figure.add_axes(box(width_in, height_in, margins))


class Grid(NamedTuple):
    """How small panels of one size are laid out.

    Attributes:
        columns: panels in a row.
        height_in: of a panel, inches; None: as high as it is wide.
        gap_in: between columns and between rows, inches.
    """

    columns: int
    height_in: float | None
    gap_in: tuple[float, float] = (0.14, 0.30)


def panels(
    count: int, grid: Grid, width_in: float, margins: Margins = MARGINS, projection: str | None = None
) -> tuple[Figure, list[Axes]]:
    """A figure with several panels, row by row from the top left, within fixed margins."""
    rows = -(-count // grid.columns)
    across, down = grid.gap_in
    width = (width_in - margins.left - margins.right - (grid.columns - 1) * across) / grid.columns
    height = width if grid.height_in is None else grid.height_in
    total = rows * height + (rows - 1) * down + margins.bottom + margins.top
    figure = Figure(figsize=(width_in, total))
    drawn = []
    for i in range(count):
        row, column = divmod(i, grid.columns)
        left = margins.left + column * (width + across)
        bottom = total - margins.top - (row + 1) * height - row * down
        place = (left / width_in, bottom / total, width / width_in, height / total)
        drawn.append(figure.add_axes(place, projection=projection))
    return figure, drawn


def legend_on_top(figure: Figure, handles: list[Any], columns: int) -> None:
    """One legend over all panels of a figure."""
    left = figure.axes[0].get_position().x0 if figure.axes else 0.0
    top = 1.0 - 0.03 / float(figure.get_size_inches()[1])
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(left, top), ncols=columns)


def box(width_in: float, height_in: float, margins: Margins) -> tuple[float, float, float, float]:
    """Left, bottom, width and height of what the margins leave, as shares of the figure."""
    left, right, bottom, top = margins
    return (
        left / width_in,
        bottom / height_in,
        (width_in - left - right) / width_in,
        (height_in - bottom - top) / height_in,
    )


def legend_above(axes: Axes, columns: int, **options: Any) -> None:
    """A legend in one or two lines over the panel."""
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.01), ncols=columns, **options)
