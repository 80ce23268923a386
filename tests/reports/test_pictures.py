"""The figures of a diagnosis as files."""

from pathlib import Path
from shutil import copytree

import pytest
from PIL import Image

from diagnosis.result import DIAGNOSIS
from reports.pictures import write_pictures
from session import InputError
from tests.reports.diagnoses import PROVENANCE, made_data

SAMPLE = Path(__file__).parents[2] / "datasets" / "sample"


def session_in(folder: Path) -> Path:
    return Path(copytree(SAMPLE, folder / "session", ignore=lambda *_: ["results", "videos"]))


def test_a_diagnosed_session_gets_a_picture_of_each_figure(tmp_path: Path) -> None:
    session = session_in(tmp_path)
    DIAGNOSIS.write(session / "results", PROVENANCE, made_data())
    written = write_pictures(session, tmp_path / "pictures")
    assert {path.stem for path in written} == {
        "gap-fish",
        "gap-shares",
        "gap-slides",
        "gap-effects",
        "gap-waterfall",
        "gap-held-out",
        "gap-forces",
        "gap-separation",
    }
    for path in written:
        with Image.open(path) as picture:
            assert picture.width > 600
            assert picture.convert("L").getextrema()[0] < 100  # there is something on it


def test_a_session_that_was_not_diagnosed_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the result is not there"):
        write_pictures(session_in(tmp_path), tmp_path / "pictures")
    assert not (tmp_path / "pictures").exists()
