"""Markdown tables of all benchmarks, from the files in `docs/scores`; the site shows them on one page.

`python -m benchmarks … --json > docs/scores/NAME.json` writes such a file.
"""

from pathlib import Path

from benchmarks.scores import Scores

DOCS = Path(__file__).parents[1] / "docs"
SCORES = DOCS / "scores"


def score_tables() -> str:
    """Return the tables of every benchmark as Markdown, in the order of their files."""
    every = [Scores.read(path) for path in sorted(SCORES.glob("*.json"))]
    return "\n\n".join(f"## {scores.title}\n\n{scores.text()}" for scores in every) + "\n"
