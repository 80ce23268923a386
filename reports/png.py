"""A matplotlib figure as PNG, on the light ground that it was drawn for."""

import io

from matplotlib.figure import Figure

from reports.style import SURFACE, applied


def png_of(figure: Figure, dots_per_inch: float) -> bytes:
    """The same bytes for the same figure: without the name of the program that drew it."""
    buffer = io.BytesIO()
    with applied():
        figure.savefig(buffer, format="png", dpi=dots_per_inch, facecolor=SURFACE, metadata={"Software": None})
    return buffer.getvalue()
