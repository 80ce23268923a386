"""The page on the structure of the code names every file of the program, and no other."""

import re

from tests.docs.test_reference import PACKAGES
from tests.test_documents import ROOT

PAGE = (ROOT / "docs" / "structure.md").read_text()


def test_every_file_of_the_program_has_its_room_on_the_page() -> None:
    rooms = re.findall(r"^- `([\w/]+)/`: ((?:.+\n)(?:  .+\n)*)", PAGE, flags=re.MULTILINE)
    named = {f"{folder}/{name}.py" for folder, names in rooms for name in re.split(r",\s+", names.strip())}
    files = {path.relative_to(ROOT).as_posix() for package in PACKAGES for path in (ROOT / package).rglob("*.py")}
    assert named == {file for file in files if not file.rpartition("/")[2].startswith("__")}


def test_every_file_that_the_page_points_at_is_there() -> None:
    pointed = re.findall(r"`((?:\w+/)+\w+\.py)`", PAGE)
    assert pointed
    assert [file for file in pointed if not (ROOT / file).is_file()] == []
