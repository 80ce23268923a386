"""The list of notebooks as Markdown: of each its title and how it begins."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"


def tutorials() -> str:
    """A numbered list with links."""
    return "\n".join(_entries())


def _entries() -> Iterator[str]:
    for number, file in enumerate(sorted(NOTEBOOKS.glob("*.ipynb")), 1):
        cells = json.loads(file.read_text())["cells"]
        text = "".join(next(cell["source"] for cell in cells if cell["cell_type"] == "markdown"))
        title, _, story = text.removeprefix("# ").partition("\n")
        paragraph = " ".join(story.strip().partition("\n\n")[0].split())
        sentences = re.split(r"(?<=[.?!]) (?=[A-Z])", paragraph)
        yield f"{number}. [{title}](../notebooks/{file.name}): {' '.join(sentences[:2])}"
