"""How many square panels stand side by side: few share half a row, many fill it."""

from typing import NamedTuple

from reports.style import FULL_WIDTH_IN, HALF_WIDTH_IN


class Layout(NamedTuple):
    """Width of the figure (inches), panels in a row, and whether the figure fills the width of the page."""

    width_in: float
    columns: int
    wide: bool


def small_multiples(count: int) -> Layout:
    """The layout of a panel for each of some trials."""
    if count <= 3:
        return Layout(HALF_WIDTH_IN, max(count, 1), wide=False)
    return Layout(FULL_WIDTH_IN, 4 if count in (4, 7, 8) else 5, wide=True)
