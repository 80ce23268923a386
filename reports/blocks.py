"""What a report is built of: sections of blocks, all plain data.

How each looks stands in `templates/blocks.html.j2`, one macro a kind.

Text is escaped when it is rendered; only `markupsafe.Markup` goes in as it is.
"""

from dataclasses import dataclass
from typing import ClassVar

from markupsafe import Markup


@dataclass(frozen=True)
class Tile:
    """A key number.

    Attributes:
        label: what it is.
        value: as printed.
        unit: of the value.
        detail: what to compare it with.
        warning: why it is doubtful; empty if it is not.
    """

    label: str
    value: str
    unit: str = ""
    detail: str = ""
    warning: str = ""


@dataclass(frozen=True)
class Tiles:
    """Key numbers side by side."""

    kind: ClassVar[str] = "tiles"
    tiles: tuple[Tile, ...]


@dataclass(frozen=True)
class Prose:
    """A paragraph; a `lead` is printed large."""

    kind: ClassVar[str] = "prose"
    text: str
    lead: bool = False


@dataclass(frozen=True)
class Plot:
    """A figure in the page.

    Attributes:
        svg: from `reports.svg.inline_svg`.
        name: unique in the page; also the name of a file saved from it.
        caption: what to see in it.
        caveat: what makes it doubtful; empty if nothing does.
        wide: over the whole width instead of half of it.
        scrolls: on a narrow screen it keeps its size and scrolls instead of shrinking.
        tall: it has a row for each trial; on paper it may take most of a page.
    """

    svg: Markup
    name: str
    caption: str
    caveat: str = ""
    wide: bool = False
    scrolls: bool = False
    tall: bool = False


@dataclass(frozen=True)
class Plots:
    """Figures: two side by side where there is room."""

    kind: ClassVar[str] = "plots"
    plots: tuple[Plot, ...]


@dataclass(frozen=True)
class Column:
    """Head of a column: its title, its unit and whether it holds numbers."""

    title: str
    unit: str = ""
    numeric: bool = True


@dataclass(frozen=True)
class Table:
    """Rows of printed cells.

    Attributes:
        caption: what it shows.
        columns: one for each cell of a row.
        rows: the cells.
        totals: rows set apart at the end.
        folded: closed until clicked (print shows it).
    """

    kind: ClassVar[str] = "table"
    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]
    totals: tuple[tuple[str, ...], ...] = ()
    folded: bool = False


@dataclass(frozen=True)
class Points:
    """A list of sentences under a title; `doubtful` ones stand out."""

    kind: ClassVar[str] = "points"
    title: str
    items: tuple[str, ...]
    doubtful: bool = False


@dataclass(frozen=True)
class Terms:
    """Terms or keys, each with its text."""

    kind: ClassVar[str] = "terms"
    items: tuple[tuple[str, str], ...]


Block = Tiles | Prose | Plots | Table | Points | Terms


@dataclass(frozen=True)
class Section:
    """A part of the page.

    Attributes:
        title: its heading.
        anchor: its id in the page.
        blocks: what it shows, in order.
        caveats: what makes its numbers doubtful; printed before the blocks.
        parts: sections within it.
    """

    title: str
    anchor: str
    blocks: tuple[Block, ...] = ()
    caveats: tuple[str, ...] = ()
    parts: tuple["Section", ...] = ()
