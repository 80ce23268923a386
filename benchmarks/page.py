"""The page of scores: `python -m benchmarks.page` writes `docs/benchmarks.md` from the files in `docs/scores`.

`calib benchmark … --json > docs/scores/NAME.json` writes such a file.
"""

from collections.abc import Iterable
from pathlib import Path
from textwrap import TextWrapper

from benchmarks.scores import Scores, Table
from session.results import write_whole

DOCS = Path(__file__).parents[1] / "docs"
SCORES = DOCS / "scores"
_WIDTH = 120  # characters of a line
_HEAD = """# Benchmark results

Written by `python -m benchmarks.page` from the files in `scores/`; do not edit. Intervals are 95 % intervals unless a
table states otherwise. Methods: [withheld effects](withheld.md), [posterior](posterior.md), [tracking](tracking.md)."""


def page() -> str:
    """As Markdown, the benchmarks in the order of their files."""
    every = [Scores.read(path) for path in sorted(SCORES.glob("*.json"))]
    return "\n\n".join([_HEAD, *map(_section, every)]) + "\n"


def _section(scores: Scores) -> str:
    head = f"## {scores.title}\n\nData: {scores.data}  \nCommand: `{scores.command}`"
    notes = [_items(scores.notes)] if scores.notes else []
    return "\n\n".join([head, *(f"{table.caption}\n\n{_rows(table)}" for table in scores.tables), *notes])


def _rows(table: Table) -> str:
    """A table, or a list where a row is longer than a line."""
    rule = ("---",) * len(table.columns)
    lines = [f"| {' | '.join(cells)} |" for cells in (table.columns, rule, *table.rows)]
    if max(map(len, lines)) <= _WIDTH:
        return "\n".join(lines)
    named = [zip(table.columns[1:], row[1:], strict=True) for row in table.rows]
    found = ["; ".join(f"{column} {cell}" for column, cell in row if cell) for row in named]
    return _items(f"{row[0]}: {values}" for row, values in zip(table.rows, found, strict=True))


def _items(texts: Iterable[str]) -> str:
    whole = TextWrapper(_WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
    return "\n".join(whole.fill(f"- {text}".replace(" %", "\u00a0%")) for text in texts)


if __name__ == "__main__":
    write_whole(DOCS / "benchmarks.md", page())
