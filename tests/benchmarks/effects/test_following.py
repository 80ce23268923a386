"""A trial that is recommended is made in the world of its session, and the session is diagnosed with it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.cases import Run
from benchmarks.effects import following
from benchmarks.effects import making as making_module
from benchmarks.effects.drawn import one_more
from benchmarks.effects.filming import Filming, film_together
from benchmarks.effects.folder import DIAGNOSIS, Answer
from benchmarks.effects.following import confused, follow_suite, wanted
from benchmarks.effects.making import Making
from benchmarks.effects.scoring import score_all, score_followed
from benchmarks.effects.severity import Strength, Strong
from benchmarks.effects.suite import Recorded, SessionPlan
from benchmarks.effects.told import Told, read_told
from benchmarks.reality.mechanisms import CATALOGUED
from diagnosis import Discrepancy
from session import load_session
from tests.benchmarks.effects.suites import suite_in

SEED, STRENGTH = 4, 1.5
SLACK = Answer("w00000002", "single", ("tendon_slack",), None, ((),), 10.0, "tail", 0.8, SEED, (1.0,))
NULL = Answer("w00000001", "null", seed=3)
SHORT = Recorded((0.9,), (1.1,), 2.5, None, free_decay=False, logged=False)
PAIR = ["tendon_friction", "tendon_slack"]
SWIM: dict[str, Any] = {"kind": "swim", "commanded_hz": 1.23, "logged": True}


def told(groups: list[list[str]], trials: tuple[dict[str, Any] | None, ...] = ()) -> dict[str, Any]:
    """A `diagnosis.json`."""
    names = {name for group in groups for name in group}
    named = all(len(group) == 1 for group in groups)
    return {
        "verdict": "no_gap" if not groups else "named" if named else "inseparable",
        "groups": groups,
        "probabilities": dict.fromkeys(names, 0.5),
        "where": None,
        "gap": None,
        "next_experiments": [{"separates": PAIR, "expected_error": 0.1, "trial": trial} for trial in trials],
    }


def confuses(session: Path, _discrepancy: Discrepancy, _without: frozenset[str]) -> None:
    """A program that tells slack from friction only where it sees one swim more."""
    there = [trial.name for trial in load_session(session).trials] if (session / "trials").exists() else []
    found = told([["tendon_slack"]] if any("more" in name for name in there) else [PAIR], (None, SWIM))
    path = session / DIAGNOSIS
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(found if session.name == SLACK.session else told([])))


def read(found: dict[str, Any], folder: Path) -> Told:
    (folder / "told.json").write_text(json.dumps(found))
    return read_told(folder / "told.json")


def test_what_is_followed_is_an_effect_among_several_with_a_trial_that_can_be_made(tmp_path: Path) -> None:
    left = confused(SLACK, read(told([PAIR], (None, SWIM)), tmp_path))
    assert left is not None
    assert (left.effect, left.trial.kind, left.trial.commanded_hz) == ("tendon_slack", "swim", 1.23)
    for groups, trials in (([PAIR], (None,)), ([["tendon_slack"]], (SWIM,)), ([["wave_drag", "scale_error"]], (SWIM,))):
        assert confused(SLACK, read(told(groups, trials), tmp_path)) is None


@pytest.mark.long
def test_a_recommended_trial_is_made_and_the_session_diagnosed_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(following, "recorded_by", lambda _random: SHORT)
    suite = suite_in(tmp_path, (NULL, SLACK))
    for name in (NULL.session, SLACK.session):
        confuses(suite.sessions / name, Discrepancy.independent(np.eye(1)), frozenset())
    assert list(wanted(suite)) == [SLACK.session]
    assert follow_suite(suite, confuses, Run(1)) == ()
    more = load_session(suite.followed / SLACK.session).trials[-1]
    assert (more.name, more.kind, more.role, more.commanded_hz) == ("more_f1_23", "swim", "fit", 1.23)
    assert more.motor is not None
    ((effect, after),), missing = score_followed(suite)
    assert (effect, after.groups, missing) == ("tendon_slack", (("tendon_slack",),), 0)
    assert "told apart with one trial more" in score_all(suite).scores("").text()
    assert follow_suite(suite, confuses, Run(1)) == ()
    other = told([PAIR], (SWIM | {"commanded_hz": 0.8},))
    (suite.sessions / SLACK.session / DIAGNOSIS).write_text(json.dumps(other))
    assert score_followed(suite) == ([], 1)


def test_a_suite_from_before_trials_were_recommended_is_to_be_made_anew(tmp_path: Path) -> None:
    suite = suite_in(tmp_path, (replace(SLACK, strengths=()),))
    confuses(suite.sessions / SLACK.session, Discrepancy.independent(np.eye(1)), frozenset())
    (failure,) = follow_suite(suite, confuses, Run(1))
    assert "make the suite anew" in failure.message


def as_strong_as_told(_asked: float, strong: Strong, *_: Any) -> Filming[Strength]:
    """In place of the search, which takes minutes."""
    yield from ()
    return Strength(STRENGTH, strong(STRENGTH), 10.0, ())


@pytest.mark.long
def test_all_that_was_recorded_before_stays_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The world and what is in it, both effects with draws of their own, are made again from seed and strengths."""
    plan = SessionPlan("w00000001", 3, SHORT, "double", ("drive_ratio_error", "bend_offset"))
    monkeypatch.setattr(making_module, "strength_for", as_strong_as_told)
    making = Making(CATALOGUED, Discrepancy.independent(np.eye(127)), {})
    (answer,) = film_together([making.make(plan, tmp_path / "before")])
    assert (answer.seed, answer.strengths) == (3, (STRENGTH, STRENGTH))
    for kind, hz, file in (("dry", 1.0, "more_dry1_00.csv.gz"), ("free_decay", None, "more_decay.csv.gz")):
        more = one_more(plan, kind, hz, logged=False)
        film_together([making.make_with(plan, answer.strengths, more, tmp_path / kind)])
        before, after = (sorted((tmp_path / part / plan.name / "trials").iterdir()) for part in ("before", kind))
        assert {path.name for path in after} - {path.name for path in before} == {file}
        for path in before:
            assert (tmp_path / kind / plan.name / "trials" / path.name).read_bytes() == path.read_bytes()
