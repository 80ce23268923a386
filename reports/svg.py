"""The conversion of a matplotlib figure to inline SVG: small, in the page's own font, its colours set by the page."""

import io
import re

from markupsafe import Markup
from matplotlib.figure import Figure

from reports.colours import INKS
from reports.style import applied

_VARIABLE = {ink.light: f"var(--{name}, {ink.light})" for name, ink in INKS.items()}
POINTS = 72.0  # points in an inch
_NO_METADATA = {"Date": None, "Creator": None, "Format": None, "Type": None}


def page_colour(light: str) -> str:
    """Return a light colour of `reports.colours.INKS` as a CSS variable that a page may redefine."""
    return _VARIABLE[light]


def inline_svg(figure: Figure, name: str, alt: str) -> Markup:
    """Render a figure as SVG for a page.

    Every colour of `reports.colours.INKS` becomes `var(--<ink>, <its light colour>)`, so a page may redefine it, and a
    copy saved from the page still shows it.

    Args:
        figure: the figure.
        name: unique in the page; its ids start with it.
        alt: text for those who cannot see the figure.
    """
    buffer = io.StringIO()
    with applied():
        figure.savefig(buffer, format="svg", metadata=_NO_METADATA)
    text = buffer.getvalue()
    body = re.sub(r"<[^>]*>", lambda tag: _adapt_tag(tag[0], name), text[text.index("</defs>") + len("</defs>") :])
    width, height = figure.get_size_inches() * POINTS
    head = Markup(
        '<svg role="img" aria-label="{}" viewBox="0 0 {:.1f} {:.1f}" xmlns="http://www.w3.org/2000/svg"'
        ' xmlns:xlink="http://www.w3.org/1999/xlink" style="stroke-linejoin: round; stroke-linecap: butt">'
    ).format(alt, width, height)
    return head + Markup(re.sub(r"\n\s*", "", body))


def _adapt_tag(tag: str, name: str) -> str:
    """Give one tag the page's colours and font, ids of its own, and no needless digits."""
    if tag.startswith("<g id="):
        return "" if tag.endswith("/>") else "<g>"
    tag = re.sub(r"\s+", " ", tag)
    tag = re.sub(r"#[0-9a-f]{6}\b", lambda colour: _VARIABLE.get(colour[0], colour[0]), tag)
    tag = re.sub(r"-?\d+\.\d{2,}", _round, tag)
    tag = re.sub(r"font-family: [^;\"]*;? ?", "", tag)
    return re.sub(r'\bid="|url\(#|href="#', lambda match: f"{match[0]}{name}-", tag)


def _round(number: re.Match[str]) -> str:
    """Round a number of points.

    One decimal of a point is a thirtieth of a millimetre on paper; scales and angles keep their digits.
    """
    value = float(number[0])
    return f"{value:.1f}" if abs(value) >= 10 else f"{value:.2f}"
