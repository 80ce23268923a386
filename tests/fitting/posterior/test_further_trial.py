"""What a further swim is forecast to narrow is what it narrows once it has been made."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.posterior.truth import DrawnSession
from fitting.posterior import Posterior, further_trial, sample_posterior
from fitting.posterior.further_trial import further_trials
from tests.fitting.posterior.conftest import HELD_OUT_HZ

pytestmark = pytest.mark.long


def test_the_forecast_comes_true(drawn: DrawnSession, posterior: Posterior, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(further_trial, "FREQUENCIES_HZ", np.array([HELD_OUT_HZ]))
    monkeypatch.setattr(further_trial, "SECONDS", 4.0)  # of a trial of 5 s, less the warm-up
    told = further_trials(posterior, drawn.twin)
    made = sample_posterior([*drawn.trials, *drawn.held_out], drawn.twin, effective=400, seed=0)
    ratio = told.sd[0] / made.coefficients.std(axis=0)
    assert (told.sd[0] < told.sd_now).all()
    assert np.exp(np.log(ratio).mean()) == pytest.approx(1.0, abs=0.25)
    assert (np.abs(np.log(ratio)) < np.log(1.6)).all()


def test_more_trials_are_never_forecast_to_widen(drawn: DrawnSession, posterior: Posterior) -> None:
    told = further_trials(posterior, drawn.twin)
    assert (told.sd <= told.sd_now * (1 + 1e-9)).all()
    assert (np.diff(told.shrinkage) >= 0).all()
