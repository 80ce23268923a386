"""Blocks of a page, the template that prints them, and figures as SVG in the page's colours.

A section holds blocks; `templates/blocks.html.j2` has the look of each, one macro a kind. Text is escaped when it is
rendered; only `markupsafe.Markup` goes in as it is.
"""

import io
import re
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, ClassVar, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from matplotlib.figure import Figure

from reports.style import HALF_WIDTH_IN, INKS, SURFACE, Look, applied
from reports.words import MISSING

# Figures as SVG
_VARIABLE = {ink.light: f"var(--{name}, {ink.light})" for name, ink in INKS.items()}
POINTS = 72.0  # points in an inch
_NO_METADATA = {"Date": None, "Creator": None, "Format": None, "Type": None}

# Figures among blocks
HIGHEST_IN = 3.5  # largest height of a figure that shares a row on paper
NOTEBOOK_DOTS_PER_INCH = 110.0  # resolution of a figure in a notebook


# Figures as SVG.


def page_colour(light: str) -> str:
    """Return a light colour of `reports.style.INKS` as a CSS variable that a page may redefine."""
    return _VARIABLE[light]


def inline_svg(figure: Figure, name: str, alt: str) -> Markup:
    """Render a figure as SVG for a page.

    Every colour of `reports.style.INKS` becomes `var(--<ink>, <its light colour>)`, so a page may redefine it, and a
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


# Blocks.


@dataclass(frozen=True)
class Prose:
    """A paragraph."""

    kind: ClassVar[str] = "prose"
    text: str


@dataclass(frozen=True, eq=False)
class Plot:
    """A figure with what to see in it: in a page, as a file, or as the value of a cell of a notebook.

    Attributes:
        figure: drawn with the colours of `reports.style`; may be changed and saved with matplotlib.
        name: unique in the page; also the name of a file saved from it.
        caption: what to see in it; the first sentence is for those who cannot see it.
        caveat: a caveat about the figure; empty if there is none.
        label: its own caption among figures that share one.
        narrow: the same drawn for a narrow screen; None where the page's width does for it.
    """

    figure: Figure = field(repr=False)
    name: str
    caption: str
    caveat: str = ""
    label: str = ""
    narrow: Figure | None = field(default=None, repr=False)

    @property
    def svg(self) -> Markup:
        """The figure as SVG for a page."""
        return inline_svg(self.figure, self.name, self._alt)

    @property
    def narrow_svg(self) -> Markup:
        """The figure as SVG for a narrow screen; empty where there is no other for it."""
        return Markup("") if self.narrow is None else inline_svg(self.narrow, f"{self.name}-narrow", self._alt)

    @property
    def _alt(self) -> str:
        return self.caption.partition(". ")[0].removesuffix(".")

    @property
    def wide(self) -> bool:
        """Return whether it takes the whole width instead of half of it.

        On a narrow screen it scrolls instead of shrinking.
        """
        return bool(self.figure.get_figwidth() > HALF_WIDTH_IN)

    @property
    def tall(self) -> bool:
        """Return whether it may take most of a page on paper."""
        return len(self.figure.axes) > 2 or bool(self.figure.get_figheight() > HIGHEST_IN)

    def png(self, dots_per_inch: float) -> bytes:
        """Render it on the light ground that it was drawn for; the same figure gives the same bytes."""
        buffer = io.BytesIO()
        with applied():
            options: Look = {"dpi": dots_per_inch, "facecolor": SURFACE, "metadata": {"Software": None}}
            self.figure.savefig(buffer, format="png", **options)
        return buffer.getvalue()

    def _repr_png_(self) -> bytes:
        return self.png(NOTEBOOK_DOTS_PER_INCH)

    def _ipython_display_(self) -> None:
        """Show the figure and, below it, its caption: a notebook takes only one of several forms of a value."""
        from IPython.display import display  # a dependency of the notebook that calls this

        text = f"{self.caption} {self.caveat}".strip()
        display({"image/png": self._repr_png_(), "text/plain": repr(self)}, raw=True)
        display({"text/html": f"<p>{escape(text)}</p>", "text/plain": text}, raw=True)


@dataclass(frozen=True)
class Plots:
    """Figures, two side by side where there is room.

    Attributes:
        caption: what holds for all, printed once above them; that of each is then only its `label` in the page.
        folded: whether they are closed until clicked, except in print.
    """

    kind: ClassVar[str] = "plots"
    plots: tuple[Plot, ...]
    caption: str = ""
    folded: bool = False


@dataclass(frozen=True)
class Column:
    """The head of a column: its title, its unit and whether it holds numbers."""

    title: str
    unit: str = ""
    numeric: bool = True


def table_head(heads: str) -> tuple[Column, ...]:
    """Parse the head of a table: "trial | speed [mm/s] | ratio []"; columns with brackets hold numbers."""
    parts = (head.partition(" [") for head in heads.split(" | "))
    return tuple(Column(title, unit.removesuffix("]"), bool(bracket)) for title, bracket, unit in parts)


@dataclass(frozen=True)
class Table:
    """Rows of printed cells, those of `totals` set apart at the end.

    `folded`: closed until clicked, except in print.
    """

    kind: ClassVar[str] = "table"
    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]
    totals: tuple[tuple[str, ...], ...] = ()
    folded: bool = False

    @property
    def filled(self) -> "Table":
        """The same table without columns in which no row has anything."""
        kept = [i for i in range(len(self.columns)) if any(row[i] not in ("", MISSING) for row in self.rows)]

        def chosen(rows: tuple[tuple[str, ...], ...]) -> tuple[tuple[str, ...], ...]:
            return tuple(tuple(row[i] for i in kept) for row in rows)

        columns = tuple(self.columns[i] for i in kept)
        return replace(self, columns=columns, rows=chosen(self.rows), totals=chosen(self.totals))


@dataclass(frozen=True)
class Points:
    """A list of sentences under a title; `doubtful` ones are highlighted."""

    kind: ClassVar[str] = "points"
    title: str
    items: tuple[str, ...]
    doubtful: bool = False


@dataclass(frozen=True)
class Terms:
    """Terms or keys, each with its text; with a title they are folded: closed until clicked, except in print."""

    kind: ClassVar[str] = "terms"
    items: tuple[tuple[str, str], ...]
    title: str = ""


class Bar(NamedTuple):
    """A bar of a card: its name, its value as printed, its length as a share, and whether it stands out."""

    name: str
    text: str
    share: float
    strong: bool = False


class Range(NamedTuple):
    """An interval of a card on a line: its name, its value as printed, and its ends and value as shares of the line."""

    name: str
    text: str
    low: float
    high: float
    value: float


@dataclass(frozen=True)
class Card:
    """A question of the first screen with its answer: in a few words, in sentences, as bars or intervals.

    Attributes:
        command: the command that answers the question, where nothing does yet.
    """

    title: str
    big: str
    texts: tuple[str, ...]
    bars: tuple[Bar, ...] = ()
    ranges: tuple[Range, ...] = ()
    command: str = ""


@dataclass(frozen=True, eq=False)
class FirstScreen:
    """The first screen of a report: a sentence, a swim, the speeds, answers as cards, the next step and the caveats.

    Caveats that the named effects explain are listed by themselves.
    """

    kind: ClassVar[str] = "first_screen"
    lead: str
    hero: Markup
    hero_caption: str
    plots: tuple[Plot, ...]
    cards: tuple[Card, ...]
    next_step: str
    caveats: tuple[str, ...]
    explained: tuple[str, ...]


Block = Prose | Plots | Table | Points | Terms | FirstScreen


@dataclass(frozen=True)
class Section:
    """A part of the page with its heading, its id and sections within it; caveats are printed before the blocks."""

    title: str
    anchor: str
    blocks: tuple[Block, ...] = ()
    caveats: tuple[str, ...] = ()
    parts: tuple["Section", ...] = ()

    @property
    def plots(self) -> tuple[Plot, ...]:
        """The figures of the section and of its parts."""
        own = [plot for block in self.blocks if isinstance(block, Plots | FirstScreen) for plot in block.plots]
        return (*own, *(plot for part in self.parts for plot in part.plots))


# Pages.


def render_page(template: str, **values: Any) -> str:
    """Render the page that a template of `reports/templates` makes of the values."""
    return environment("reports", escaped=True).get_template(template).render(inks=INKS, **values)


@lru_cache
def environment(package: str, escaped: bool) -> Environment:
    """Load the templates of a package, for pages (`escaped`) or for plain text."""
    return Environment(
        loader=PackageLoader(package),
        autoescape=escaped,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=not escaped,
    )
