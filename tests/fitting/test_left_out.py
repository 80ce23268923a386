"""One trial never stops the others: which take part, and which of those that do should not be trusted."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fitting.calibration import CalibratedTrial
from fitting.left_out import FAR, MISSED, extrapolation_reason, far_from_twin_flags, followed_trials
from fitting.published import Swims
from fitting.trial import MeasuredTrial
from swimcal.errors import NotEnoughData
from tests.reports.sample import made_calibration


def at(trial: MeasuredTrial, hz: float) -> MeasuredTrial:
    """The trial with another frequency, as if its tail had beaten so."""
    beat = replace(trial.frequency, hz=hz)
    return replace(trial, frequency=beat, start_frequency=beat)


def twin_that(trial: CalibratedTrial, speed: float, error_m: float = 0.005) -> CalibratedTrial:
    scores = trial.scores._replace(launch_free_error_m=error_m)
    return replace(trial, speeds={**trial.speeds, "twin": speed}, scores=scores)


def test_a_fit_trial_that_no_twin_can_swim_is_left_out(swims: Swims, trials: dict[str, MeasuredTrial]) -> None:
    slow, fast = trials["slow"], at(trials["fast"], 60.0)

    good, lost = followed_trials([slow, fast], swims.twin)
    assert good == [slow]
    assert "diverges at 60 Hz" in lost[fast.name]
    with pytest.raises(NotEnoughData, match=f"trial {fast.name}: its simulation diverges"):
        followed_trials([fast], swims.twin)


def test_how_far_outside_the_fitted_beats_nothing_is_compared() -> None:
    assert extrapolation_reason(1.2, (0.6, 1.2)) == ""
    assert extrapolation_reason(0.21, (0.6, 1.2)) == ""
    assert "3 times beyond the fitted 0.6 to 1.2 Hz" in extrapolation_reason(5.0, (0.6, 1.2))
    assert extrapolation_reason(0.1, (0.6, 1.2))


@pytest.mark.parametrize(
    ("twin", "error_m", "kinds"),
    [
        (1.01, 0.005, []),
        (1.07, 0.005, [MISSED]),
        (-0.5, 0.005, [FAR, MISSED]),
        (1.9, 0.005, [FAR, MISSED]),
        (1.0, 0.2, [FAR]),
        (1.0, 0.05, [FAR]),
        (1.0, 0.02, []),
    ],
)
def test_a_trial_far_from_its_own_twin_is_flagged(twin: float, error_m: float, kinds: list[str]) -> None:
    trial = next(each for each in made_calibration().trials if each.measured.role == "fit")
    changed = twin_that(trial, twin * trial.measured.speed, error_m)

    assert [flag.kind for flag in far_from_twin_flags(changed, [0.005, 0.006, 0.007])] == kinds
    held_out = replace(changed, measured=replace(changed.measured, role="holdout"))
    assert MISSED not in [flag.kind for flag in far_from_twin_flags(held_out, [0.005])]
