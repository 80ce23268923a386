"""Sessions of the exported twin in plain MuJoCo: their changes and their making."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.effects.changes import ChangePlan
from benchmarks.effects.plain import CHANGES, make_plain
from swimcal.effects.catalogue import catalogue
from swimcal.session import load_session


def test_every_change_is_told_by_effects_of_the_catalogue() -> None:
    assert {change(1.0).right for change in CHANGES.values()} - {""} <= set(catalogue())


@pytest.mark.long
def test_a_session_is_one_like_any_users_and_the_change_is_in_it(tmp_path: Path) -> None:
    plans = (ChangePlan("m000", 7, None), ChangePlan("m001", 7, "stiffer"), ChangePlan("m002", 7, None))
    assert make_plain(tmp_path, plans) == 3
    assert make_plain(tmp_path, plans) == 0
    sessions = [load_session(tmp_path / plan.name) for plan in plans]
    assert [trial.role for trial in sessions[0].trials] == ["fit", "fit", "holdout", "fit", "holdout", "fit"]
    first, stiffer, again = (
        np.loadtxt(path, delimiter=",", skiprows=1)
        for path in [sorted((tmp_path / plan.name / "trials").iterdir())[0] for plan in plans]
    )
    assert (first == again).all()  # the seed decides
    assert first.shape == stiffer.shape
    assert np.sqrt(np.mean((first - stiffer) ** 2)) > 5  # px
    assert not any("m00" in path.name for path in (tmp_path / "m000").rglob("*"))
