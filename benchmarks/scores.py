"""Shares and numbers that a benchmark found, with their intervals, in tables that a terminal and a page can show."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import TextWrapper
from typing import NamedTuple, TypeVar

import numpy as np
from scipy.stats import binomtest

from swimcal.results import from_plain, plain_json, to_plain

T = TypeVar("T")
DOCS = Path(__file__).parents[1] / "docs"
SCORES = DOCS / "scores"
"""Folder of score files: `python -m benchmarks … --json > docs/scores/NAME.json` writes one."""
_FEWEST = 5  # An interval by resampling needs at least this many values.
_DRAWS = 400
_SEED = 0
_MAX_CHARACTERS = 120  # A table with a longer line becomes a list.


class Share(NamedTuple):
    """Number of cases out of a total, with a 95 % interval (Wilson 1927)."""

    hits: int
    of: int

    @classmethod
    def among(
        cls, cases: Sequence[T], right: Callable[[T], bool], counts: Callable[[T], bool] = lambda _: True
    ) -> Share:
        """Count, of the cases that count, those of which something holds."""
        chosen = [case for case in cases if counts(case)]
        return cls(sum(right(case) for case in chosen), len(chosen))

    @property
    def value(self) -> float:
        """Share of cases; nan of none."""
        return self.hits / self.of if self.of else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the share; nan of none."""
        if not self.of:
            return float("nan"), float("nan")
        found = binomtest(self.hits, self.of).proportion_ci(0.95, method="wilson")
        return float(found.low), float(found.high)

    def __str__(self) -> str:
        low, high = self.interval
        return f"{self.hits} of {self.of} ({100 * low:.0f} to {100 * high:.0f} %)" if self.of else "none"


class Estimate(NamedTuple):
    """A number with a 95 % interval; nan of nothing, an interval of nan where there is too little for one."""

    value: float
    interval: tuple[float, float]

    def __str__(self) -> str:
        if np.isnan(self.value):
            return "none"
        known = not np.isnan(self.interval).any()
        return f"{self.value:.3g}" + (f" ({self.interval[0]:.3g} to {self.interval[1]:.3g})" if known else "")


def median(values: Sequence[float]) -> Estimate:
    """Return the median of a few numbers."""
    return resampled(values, lambda drawn: float(np.median(drawn)) if len(drawn) else float("nan"))


def resampled(of: Sequence[T], estimate: Callable[[Sequence[T]], float]) -> Estimate:
    """Estimate with the interval that drawing as many anew gives (percentiles; Efron 1979)."""
    value = estimate(of)
    if len(of) < _FEWEST or np.isnan(value):
        return Estimate(value, (float("nan"),) * 2)
    random = np.random.default_rng(_SEED)
    drawn = [estimate([of[i] for i in random.integers(len(of), size=len(of))]) for _ in range(_DRAWS)]
    low, high = np.nanquantile(drawn, [0.025, 0.975])
    return Estimate(value, (float(low), float(high)))


class Measure(NamedTuple):
    """One row of a table."""

    label: str  # words for what is counted
    found: Share | Estimate  # number that was found
    asked: str = ""  # required value; empty where nothing is asked


class Table(NamedTuple):
    """Text in rows; the first column names what a row is about."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    @classmethod
    def of(cls, caption: str, measured: Mapping[str, Mapping[str, Measure]]) -> Table:
        """Build a row for each measure, a column for each subject; the first column gives what is required."""
        first, *others = measured.values()
        rows = [
            (row.label, row.asked, str(row.found), *(str(each[name].found) for each in others))
            for name, row in first.items()
        ]
        return cls(caption, ("", "required", *measured), tuple(rows))

    def text(self) -> str:
        """Return Markdown: a table, or a list where a row is longer than a line."""
        rule = ("---",) * len(self.columns)
        lines = [f"| {' | '.join(cells)} |" for cells in (self.columns, rule, *self.rows)]
        if max(map(len, lines)) <= _MAX_CHARACTERS:
            return "\n".join([self.caption, "", *lines])
        named = [zip(self.columns[1:], row[1:], strict=True) for row in self.rows]
        found = ["; ".join(f"{column} {cell}" for column, cell in row if cell) for row in named]
        items = _format_items(f"{row[0]}: {values}" for row, values in zip(self.rows, found, strict=True))
        return f"{self.caption}\n\n{items}"


@dataclass(frozen=True)
class Scores:
    """Scores of one benchmark, as a JSON file or as Markdown."""

    title: str  # title of the benchmark
    data: str  # data that it was measured on, and whether they are synthetic
    command: str  # command that measures it again
    tables: tuple[Table, ...]  # tables of the numbers
    notes: tuple[str, ...] = ()  # notes that a reader must know

    def text(self) -> str:
        """Return Markdown, without the title."""
        parts = [f"Data: {self.data}  \nCommand: `{self.command}`", *(table.text() for table in self.tables)]
        return "\n\n".join([*parts, *([_format_items(self.notes)] if self.notes else [])])

    def json(self) -> str:
        """Return the text for a JSON file."""
        return json.dumps(plain_json(to_plain(self)), indent=1, ensure_ascii=False) + "\n"

    @classmethod
    def read(cls, path: Path) -> Scores:
        """Read scores from a file.

        Raises:
            OSError, KeyError, TypeError, ValueError: it holds none.
        """
        scores: Scores = from_plain(cls, json.loads(path.read_bytes()))
        return scores


def score_tables() -> str:
    """Return the tables of every benchmark as Markdown, in the order of their files, for the site."""
    every = [Scores.read(path) for path in sorted(SCORES.glob("*.json"))]
    return "\n\n".join(f"## {scores.title}\n\n{scores.text()}" for scores in every) + "\n"


def _format_items(texts: Iterable[str]) -> str:
    whole = TextWrapper(_MAX_CHARACTERS, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
    return "\n".join(whole.fill(f"- {text}".replace(" %", "\u00a0%")) for text in texts)
