"""What docs/start.md says the demo prints, and tells of the sample's truth, is so."""

import re
import shutil
from pathlib import Path

import pytest

import calib

ROOT = Path(__file__).resolve().parents[2]
NUMBER = re.compile(r"[-−]?\d+(?:\.\d+)?")


def quoted() -> list[str]:
    """The lines of output that docs/start.md quotes, each up to where it is cut."""
    text = re.findall(r"```text\n(.*?)```", (ROOT / "docs" / "start.md").read_text(), re.DOTALL)
    return [line.partition("…")[0].strip() for line in text[0].splitlines()]


@pytest.mark.long
def test_the_demo_prints_what_the_first_page_quotes(tmp_path: Path) -> None:
    """But for what depends on the machine's arithmetic: a quick search ends where it is near enough."""
    folder = tmp_path / "sample"
    shutil.copytree(ROOT / "datasets" / "sample", folder, ignore=shutil.ignore_patterns("results"))

    said = {line.partition(":")[0]: line for line in calib.run(folder, "quick", progress=False).summary().splitlines()}

    assert len(quoted()) == 7
    for line in quoted():
        own = said[line.partition(":")[0]]
        assert NUMBER.split(own)[: len(NUMBER.split(line)) - 1] == NUMBER.split(line)[:-1]
        for found, told in zip(NUMBER.findall(own), NUMBER.findall(line), strict=False):
            assert float(found.replace("−", "-")) == pytest.approx(float(told.replace("−", "-")), rel=0.1, abs=0.6)


def test_the_truth_that_the_first_page_tells_is_that_of_the_card() -> None:
    card = (ROOT / "datasets" / "sample" / "CARD.md").read_text()
    found = re.search(r"in the picture ([\d.]+) to the right and ([\d.]+) up", card)
    assert found is not None
    page = (ROOT / "docs" / "start.md").read_text().replace("\n", " ")
    assert f"a current of {found[1]} mm/s to the right and {found[2]} mm/s up" in page
