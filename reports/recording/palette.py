"""Colours on the viewer's dark ground."""

from colorsys import hsv_to_rgb

from reports.colours import INKS
from tracking.records import SampleState

Rgb = tuple[int, int, int]

GOLDEN_RATIO = 0.618034


def rgb(hexadecimal: str) -> Rgb:
    """The colour ``#rrggbb`` as three numbers from 0 to 255."""
    red, green, blue = bytes.fromhex(hexadecimal.removeprefix("#"))
    return red, green, blue


TWIN, WARN, MUTED, GAP = (rgb(INKS[name].dark) for name in ("twin", "warn", "muted", "gap"))

STATE_COLOURS: dict[SampleState, Rgb] = {
    SampleState.MISSING: rgb(INKS["flag-segment"].dark),
    SampleState.MEASURED: rgb(INKS["flag-other"].dark),
    SampleState.PREDICTED: rgb(INKS["ebt"].dark),
    SampleState.INTERPOLATED: rgb(INKS["flag-merged"].dark),
    SampleState.BY_HAND: rgb(INKS["ink"].dark),
}
"""A colour for each state of a sample."""


def marker_colour(index: int) -> Rgb:
    """A colour for the marker of this index; neighbours differ by 0.618 of the colour wheel."""
    red, green, blue = (round(255 * part) for part in hsv_to_rgb((0.08 + index * GOLDEN_RATIO) % 1.0, 0.55, 1.0))
    return red, green, blue
