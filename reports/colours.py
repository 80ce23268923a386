"""The colours of figures and pages, for light and for dark ground.

Figures are drawn in the light colours, so that they can be used in a notebook or a talk; in a page each becomes
a CSS variable (`reports.svg`), and the page chooses.
"""

from typing import NamedTuple


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
