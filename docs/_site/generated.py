"""Generated parts of pages: each stands on the site where its page has a mark."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

from catalogue import catalogue
from command_line import command_line
from messages import messages
from records import record

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
_MARK = re.compile(r"<!-- generated: (?:(catalogue|command line|messages|scores|tutorials|words)|record (\S+)) -->")


def filled(page: str) -> str:
    """Return a page with what is generated in the place of its marks."""
    return _MARK.sub(_generate, page)


def _generate(mark: re.Match[str]) -> str:
    return _WHOLE[mark[1]]() if mark[1] else record(mark[2])


def words() -> str:
    """Return the words of a report as its last section explains them, a heading for each."""
    from reports.report import TERMS

    return "\n".join(f"### {term}\n\n{meaning}\n" for term, meaning in TERMS.items())


def scores() -> str:
    """Return the tables of all benchmarks."""
    from benchmarks.scores import score_tables

    return score_tables()


def tutorials() -> Iterator[str]:
    """Yield a numbered list of the notebooks: of each its title, with a link, and how it begins."""
    for number, file in enumerate(sorted(NOTEBOOKS.glob("*.ipynb")), 1):
        cells = json.loads(file.read_text())["cells"]
        text = "".join(next(cell["source"] for cell in cells if cell["cell_type"] == "markdown"))
        title, _, story = text.removeprefix("# ").partition("\n")
        paragraph = " ".join(story.strip().partition("\n\n")[0].split())
        sentences = re.split(r"(?<=[.?!]) (?=[A-Z])", paragraph)
        yield f"{number}. [{title}](../notebooks/{file.name}): {' '.join(sentences[:2])}"


_WHOLE = {
    "catalogue": catalogue,
    "command line": command_line,
    "messages": messages,
    "scores": scores,
    "tutorials": lambda: "\n".join(tutorials()),
    "words": words,
}
