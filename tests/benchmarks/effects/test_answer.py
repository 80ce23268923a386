"""Answers are read again as they were written, by whoever has their checksum, and by no eye."""

from pathlib import Path

import pytest

from benchmarks.effects.answer import Answer, seal, unseal
from session import InputError

ANSWERS = (
    Answer("a7", "null"),
    Answer("b2", "single", ("tendon_slack",), None, (("tendon_friction",),), 3.3, "tail", 0.8),
    Answer("c9", "outside", outside="tether", detectability=5.0, stage="body"),
)


def test_answers_come_back(tmp_path: Path) -> None:
    path = tmp_path / "answers.sealed"
    assert unseal(path, seal(ANSWERS, path)) == ANSWERS


def test_the_file_tells_nothing_to_a_reader(tmp_path: Path) -> None:
    seal(ANSWERS, tmp_path / "answers.sealed")
    text = (tmp_path / "answers.sealed").read_text()
    assert "slack" not in text
    assert "single" not in text
    assert max(map(len, text.splitlines())) <= 120


def test_every_file_is_as_long_whatever_it_says(tmp_path: Path) -> None:
    for answer in ANSWERS:
        seal([answer], tmp_path / f"{answer.session}.sealed")
    assert len({path.stat().st_size for path in tmp_path.iterdir()}) == 1


def test_answers_of_another_suite_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "answers.sealed"
    seal(ANSWERS, path)
    with pytest.raises(InputError, match="another checksum"):
        unseal(path, "0" * 64)
