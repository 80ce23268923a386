"""Answers are read again as they were written."""

from pathlib import Path

import pytest

from benchmarks.effects.folder import Answer


@pytest.mark.parametrize(
    "answer",
    [
        Answer("a7", "null"),
        Answer("b2", "single", ("tendon_slack",), None, (("tendon_friction",),), 3.3, "tail", 0.8),
        Answer("c9", "outside", outside="tether", detectability=5.0, stage="body"),
    ],
    ids=lambda answer: answer.kind,
)
def test_answers_come_back(answer: Answer, tmp_path: Path) -> None:
    answer.write(tmp_path / "answer.json")
    assert Answer.read(tmp_path / "answer.json") == answer
