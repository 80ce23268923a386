"""Fit and held-out trials told apart by shape, in every figure alike."""

from typing import Any

from reports.style import SURFACE


def role_marker(colour: str, role: str) -> dict[str, Any]:
    """Plot options: filled circles were fitted, open diamonds were held out."""
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
