"""Colours and style of every figure, and the layout of its panels.

`INKS` are the colours of figures and pages, for light and for dark ground. Figures are drawn in the light colours, so
that they can be used in a notebook or a talk; in a page each becomes a CSS variable (`reports.page`), and the page
chooses.
"""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from functools import wraps
from pathlib import Path
from typing import Any, NamedTuple, ParamSpec

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D


class Ink(NamedTuple):
    """A colour on light and on dark ground. No two share a light colour: it identifies them."""

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

INK = INKS["ink"].light
MUTED = INKS["muted"].light
FAINT = INKS["faint"].light
SHADE = INKS["shade"].light
SURFACE = INKS["surface"].light
TWIN = INKS["twin"].light
WARN = INKS["warn"].light
EBT = INKS["ebt"].light
EBT_LARGE = INKS["ebt-large"].light
EBT_SMOOTHED = INKS["ebt-smoothed"].light
GAP = INKS["gap"].light

HALF_WIDTH_IN = 4.2  # width of figures that share a row
FULL_WIDTH_IN = 8.7  # width of figures that fill a row

Look = dict[str, Any]
"""Options with which matplotlib draws something."""

_SHEET = Path(__file__).parent / "templates" / "figures.mplstyle"
_COLOURS = {
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "grid.color": FAINT,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
}

P = ParamSpec("P")


def applied() -> AbstractContextManager[None]:
    """Apply the settings for as long as the block lasts."""
    return matplotlib.style.context([_SHEET, _COLOURS])


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Decorate a function that draws a figure, so that it draws under the settings."""

    @wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with applied():
            return draw(*args, **kwargs)

    return drawn


class Margins(NamedTuple):
    """The space around a panel, inches."""

    left: float = 0.60
    right: float = 0.10
    bottom: float = 0.42
    top: float = 0.34


MARGINS = Margins()


class Grid(NamedTuple):
    """The layout of small panels of one size.

    Attributes:
        columns: panels in a row.
        height_in: height of a panel, inches.
        gap_in: gaps between columns and between rows, inches.
    """

    columns: int
    height_in: float
    gap_in: tuple[float, float] = (0.14, 0.30)


def panel(width_in: float, height_in: float, margins: Margins = MARGINS) -> tuple[Figure, Axes]:
    """Make a figure with one panel within fixed margins, which costs less than any automatic layout.

    Args:
        width_in: width of the figure, inches.
        height_in: height of the figure, inches.
        margins: space around the panel.
    """
    left, right, bottom, top = margins
    figure = Figure(figsize=(width_in, height_in))
    return figure, add_panel(figure, (left, bottom), (width_in - left - right, height_in - bottom - top))


def panels(count: int, grid: Grid, width_in: float, margins: Margins = MARGINS) -> tuple[Figure, list[Axes]]:
    """Make a figure with several panels, row by row from the top left, within fixed margins.

    Args:
        count: number of panels.
        grid: their layout.
        width_in: width of the figure, inches.
        margins: space around all panels.
    """
    rows = -(-count // grid.columns)
    across, down = grid.gap_in
    width = (width_in - margins.left - margins.right - (grid.columns - 1) * across) / grid.columns
    total = rows * grid.height_in + (rows - 1) * down + margins.bottom + margins.top
    figure = Figure(figsize=(width_in, total))
    drawn = []
    for i in range(count):
        row, column = divmod(i, grid.columns)
        corner = margins.left + column * (width + across), total - margins.top - (row + 1) * grid.height_in - row * down
        drawn.append(add_panel(figure, corner, (width, grid.height_in)))
    return figure, drawn


def add_panel(figure: Figure, corner: tuple[float, float], size: tuple[float, float]) -> Axes:
    """Add a panel with this lower left corner and this width and height, all in inches."""
    width_in, height_in = figure.get_size_inches()
    place = (corner[0] / width_in, corner[1] / height_in, size[0] / width_in, size[1] / height_in)
    return figure.add_axes(place)


def small_multiples(count: int) -> tuple[float, int]:
    """Choose the width of a figure with a panel for each trial (inches), and the panels in a row.

    A few panels share half a page's width.
    """
    if count <= 3:
        return HALF_WIDTH_IN, max(count, 1)
    return FULL_WIDTH_IN, 6 if count == 6 else 4 if count in (4, 7, 8) else 5


def name_panels(drawn: Sequence[Axes], names: Sequence[str], columns: int, x: str = "", y: str = "") -> None:
    """Write a title on each of several panels that share their scales; numbers and axis names on the outer ones alone.

    Args:
        drawn: the panels, row by row.
        names: their titles.
        columns: panels in a row.
        x: name of the x axis.
        y: name of the y axis.
    """
    for number, (axes, name) in enumerate(zip(drawn, names, strict=True)):
        left, lowest = number % columns == 0, number + columns >= len(drawn)
        axes.set_title(name, loc="left", fontweight="bold", pad=3)
        axes.tick_params(labelleft=left, labelbottom=lowest)
        axes.set(xlabel=x if lowest else "", ylabel=y if left else "")


def legend_on_top(figure: Figure, columns: int, handles: Sequence[Any] = ()) -> None:
    """Draw one legend over all panels of a figure: of these handles, or of each label that is drawn, once.

    Args:
        figure: the figure.
        columns: entries in a row.
        handles: handles of the legend; default: those of all labels that are drawn.
    """
    left, top = figure.axes[0].get_position().x0, 1.0 - 0.03 / float(figure.get_size_inches()[1])
    handles = handles or _collect_labels(figure.axes)
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(left, top), ncols=columns)


def legend_above(axes: Axes, columns: int, **options: Any) -> None:
    """Draw a legend in one or two lines over the panel, of each label that is drawn, once."""
    handles = _collect_labels([axes])
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.01), ncols=columns, **options)


def role_marker(colour: str, role: str) -> Look:
    """Return the plot options of a role: filled circles were fitted, open diamonds were held out."""
    fit = role == "fit"
    return {
        "marker": "o" if fit else "D",
        "markersize": 5.5 if fit else 5.0,
        "markerfacecolor": colour if fit else SURFACE,
        "markeredgecolor": colour,
        "markeredgewidth": 1.3,
        "linestyle": "none",
        "zorder": 3,
    }


def role_handles(colour: str) -> list[Line2D]:
    """Make the handles for a legend of roles."""
    names = {"fit": "fit trial", "holdout": "held-out trial"}
    return [Line2D([], [], label=label, **role_marker(colour, role)) for role, label in names.items()]


def _collect_labels(drawn: Sequence[Axes]) -> list[Any]:
    found = [pair for axes in drawn for pair in zip(*axes.get_legend_handles_labels(), strict=True)]
    return list({label: handle for handle, label in found}.values())
