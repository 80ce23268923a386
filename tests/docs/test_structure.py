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


def test_no_title_in_the_code_stands_without_what_it_announces() -> None:
    bare = []
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            lines = path.read_text().splitlines()
            for number, line in enumerate(lines):
                below = [each for each in lines[number + 1 :] if each.strip()]
                if re.match("# [A-Z]", line) and (not below or (lines[number + 1] == "" and below[0].startswith("# "))):
                    bare.append(f"{path.relative_to(ROOT)}:{number + 1}")
    assert bare == []
