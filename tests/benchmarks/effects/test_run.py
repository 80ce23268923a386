"""A suite is made once, in parts and after an interruption."""

from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.cases import Failure, Run, write_record
from benchmarks.effects import run
from benchmarks.effects.folder import Answer, SuiteFolder
from benchmarks.effects.making import GENERATORS, Generator
from benchmarks.effects.run import make_suite
from benchmarks.effects.suite import SessionPlan, SuiteSize, plan_suite, suite_named
from benchmarks.reality.mechanisms import CATALOGUED, OUTSIDE
from swimcal.errors import InputError
from swimcal.results import write_whole
from tests.benchmarks.effects.suites import shortened

ALONE = Run(workers=1)
SIZE = SuiteSize(5, 5)  # nothing in them: no severity is sought, which takes a minute each
PLANS = plan_suite(4, SIZE, tuple(CATALOGUED), tuple(OUTSIDE))
NAMES = [plan.name for plan in PLANS]


def _planning(plans: tuple[SessionPlan, ...]) -> dict[str, Generator]:
    return {"reality": replace(GENERATORS["reality"], plan=lambda *_: plans)}


@pytest.fixture(autouse=True)
def _short_swims(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "GENERATORS", _planning(tuple(shortened(plan) for plan in PLANS)))
    monkeypatch.setattr(run, "_TOGETHER", 1)  # and so two in a piece


@pytest.mark.long
def test_broken_off_it_goes_on_where_it_was(tmp_path: Path) -> None:
    """Of what was being written when it broke off, nothing stays; what was made is not made again."""
    suite, stopped = SuiteFolder(tmp_path), []

    def stop(_said: str, _share: float | None) -> None:
        stopped.append(True)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_suite(suite, 4, SIZE, Run(1, stop))
    made = {path.parent: path.stat().st_ino for path in suite.sessions.glob("*/session.toml")}
    unfinished = next(name for name in NAMES if suite.sessions / name not in made)
    (suite.sessions / unfinished / "trials").mkdir(parents=True)
    (suite.sessions / f".{unfinished}.part.x1").mkdir()
    assert make_suite(suite, 4, SIZE, ALONE) == ()
    assert len(stopped) == 1
    assert len(made) == 2
    assert all((session / "session.toml").stat().st_ino == node for session, node in made.items())
    assert [path.name for path in sorted(suite.sessions.iterdir())] == NAMES
    assert list(suite.names) == NAMES


def test_a_suite_may_be_made_in_shards(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A fifth is one of five sessions; what is published is what is there; the rest joins it."""
    tried: list[str] = []

    def made(suite: SuiteFolder, _by: str, plans: tuple[SessionPlan, ...]) -> list[Failure]:
        for plan in plans:
            tried.append(plan.name)
            write_whole(suite.sessions / plan.name / "session.toml", b"")
            write_record(suite.answer(plan.name), Answer(plan.name, "null"))
        return []

    monkeypatch.setattr(run, "_make_together", made)
    suite = SuiteFolder(tmp_path)
    suite.answers.mkdir()
    assert make_suite(suite, 4, SIZE, ALONE, slice(1, None, 5)) == ()
    assert suite.names == tuple(tried) == (NAMES[1],)
    assert make_suite(suite, 4, SIZE, ALONE, slice(0, None, 2)) == ()
    assert sorted(tried) == sorted([NAMES[1], *NAMES[::2]])
    assert make_suite(suite, 4, SIZE, ALONE) == ()
    assert sorted(tried) == NAMES
    assert suite.true() == tuple(Answer(name, "null") for name in NAMES)


@pytest.mark.parametrize("text", ["", "2/10", "large:0/3", "large:4/3", "small:1/-1", "large:"])
def test_what_is_no_suite_is_told(text: str) -> None:
    with pytest.raises(ValueError, match="expected small, large, wake, or a part such as large:2/10"):
        suite_named(text)


def test_a_folder_of_another_suite_is_left_alone(tmp_path: Path) -> None:
    suite = SuiteFolder(tmp_path)
    (suite.sessions / "wffffffff").mkdir(parents=True)
    with pytest.raises(InputError, match=r"(?s)another suite.*wffffffff"):
        make_suite(suite, 4, SIZE, ALONE)


def test_a_folder_without_a_whole_suite_is_told_plainly(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"found no answers; .*--part make"):
        SuiteFolder(tmp_path).true()
    (tmp_path / "sessions").mkdir()
    with pytest.raises(InputError, match="found one that broke off"):
        _ = SuiteFolder(tmp_path).names
