"""The documents: their lines are short, and their links lead somewhere."""

import importlib
import re
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("datasets/*/CARD.md")])
LINK = re.compile(r"\]\(([^)\s]+)\)")

every_document = pytest.mark.parametrize("page", DOCUMENTS, ids=lambda page: page.relative_to(ROOT).as_posix())


@cache
def on_the_site(page: Path) -> str:
    """A page with what is generated in it."""
    if (site := str(ROOT / "docs" / "_site")) not in sys.path:
        sys.path.append(site)
    return str(importlib.import_module("generated").filled(page.read_text()))


@cache
def anchors(page: Path) -> set[str]:
    """Of its headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", on_the_site(page), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@every_document
def test_no_line_is_longer_than_120_characters(page: Path) -> None:
    assert [line for line in page.read_text().splitlines() if len(line) > 120] == []


@every_document
def test_every_link_leads_to_a_file_and_a_heading(page: Path) -> None:
    for link in LINK.findall(on_the_site(page)):
        name, _, anchor = link.partition("#")
        if not name.startswith("https://"):
            target = (page.parent / name).resolve() if name else page
            assert target.exists(), link
            assert not anchor or anchor in anchors(target), link
