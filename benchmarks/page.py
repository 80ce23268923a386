"""The page of scores: `python -m benchmarks.page` writes `docs/benchmarks.md` from the files in `docs/scores`.

`python -m benchmarks … --json > docs/scores/NAME.json` writes such a file.
"""

from pathlib import Path

from benchmarks.scores import Scores
from session.results import write_whole

DOCS = Path(__file__).parents[1] / "docs"
SCORES = DOCS / "scores"
_HEAD = """# Benchmark results

Written by `python -m benchmarks.page` from the files in `scores/`; do not edit. Intervals are 95 % intervals unless a
table states otherwise. Methods: [withheld effects](withheld.md), [third
generator](wake.md), [foreign sessions](foreign.md), [posterior](posterior.md), [tracking](tracking.md)."""


def page() -> str:
    """As Markdown, the benchmarks in the order of their files."""
    every = [Scores.read(path) for path in sorted(SCORES.glob("*.json"))]
    return "\n\n".join([_HEAD, *(f"## {scores.title}\n\n{scores.text()}" for scores in every)]) + "\n"


if __name__ == "__main__":
    write_whole(DOCS / "benchmarks.md", page())
