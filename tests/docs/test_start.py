"""What docs/start.md says the demo prints, and what the README says of the sample, is what it prints."""

import re
import shutil
from pathlib import Path

import pytest

import calib

ROOT = Path(__file__).resolve().parents[2]


def quoted() -> list[str]:
    """The lines of output that docs/start.md quotes, each up to where it is cut."""
    text = re.findall(r"```text\n(.*?)```", (ROOT / "docs" / "start.md").read_text(), re.DOTALL)
    return [line.removesuffix("…").strip() for line in text[0].splitlines()]


@pytest.mark.long
def test_the_demo_prints_what_the_first_page_quotes(tmp_path: Path) -> None:
    folder = tmp_path / "sample"
    shutil.copytree(ROOT / "datasets" / "sample", folder, ignore=shutil.ignore_patterns("results"))

    said = calib.run(folder, "quick", progress=False).summary()

    assert len(quoted()) == 6
    for line in quoted():
        assert line in said


def test_the_truth_that_the_first_page_tells_is_that_of_the_card() -> None:
    found = re.search(
        r"in the picture ([\d.]+) to the right and ([\d.]+) up", (ROOT / "datasets/sample/CARD.md").read_text()
    )
    assert found is not None
    page = (ROOT / "docs" / "start.md").read_text().replace("\n", " ")
    assert f"a current of {found[1]} mm/s to the right and {found[2]} mm/s up" in page
