"""The first identification from end to end, its file, and the sweep that goes with it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from fitting import calibration as of_calibration
from fitting.baselines import sweep_frequencies, sweep_speed
from fitting.calibration import CalibratedTrial, Calibration, calibrate, compare_trials, summarise
from fitting.ebt import FORMS, fit_ebt, measured_tail
from fitting.left_out import FAR, MISSED
from fitting.published import Swims
from fitting.session_forecast import Forecast
from fitting.structure import assumed
from fitting.trial import MeasuredTrial
from swimcal.errors import NotEnoughData, SimulationDiverged
from swimcal.robot import load_robot
from swimcal.twin import Twin
from tests.fitting.swims import with_little_search

STARTS = 1


@pytest.fixture(scope="module")
def calibration(trials: dict[str, MeasuredTrial]) -> Calibration:
    with pytest.MonkeyPatch.context() as patch:
        with_little_search(patch)
        patch.setattr(of_calibration, "sweep_frequencies", partial(sweep_frequencies, count=3))
        return calibrate(list(trials.values()), assumed(load_robot()), STARTS)


def test_every_swim_is_compared_in_the_order_of_the_session(calibration: Calibration) -> None:
    assert [trial.measured.name for trial in calibration.trials] == ["slow", "fast", "new"]
    for trial in calibration.trials:
        assert trial.simulated.position_m.shape == trial.measured.head.position_m.shape
        assert trial.scores.used_fraction == 1.0
    *_, new = calibration.trials  # held out: driven with what its known part says
    assert new.simulated_hz == new.measured.start_frequency.hz
    assert new.scores.marker_error_m < 0.1


def test_no_trial_of_the_twin_s_own_kind_of_fish_is_suspicious(calibration: Calibration) -> None:
    assert not [flag for trial in calibration.trials for flag in trial.flags if flag.kind in (FAR, MISSED)]
    assert calibration.left_out == {}


def test_a_fit_trial_whose_twin_diverges_when_it_is_compared_stops_no_other(
    calibration: Calibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    compare, doomed = of_calibration.compare_trial, {"fast"}

    def compare_or_diverge(twin: Twin, trial: MeasuredTrial, *others: Any) -> CalibratedTrial:
        if trial.name in doomed:
            raise SimulationDiverged(trial.name)
        return compare(twin, trial, *others)

    monkeypatch.setattr(of_calibration, "compare_trial", compare_or_diverge)
    trials = [trial.measured for trial in calibration.trials]
    twin, phases = Twin(calibration.robot, trials[0].markers), {each.measured.name: 0.0 for each in calibration.trials}
    found, lost = compare_trials(trials, twin, calibration.fit.coefficients, phases, {})

    assert [trial.measured.name for trial in found] == ["slow", "new"]
    assert "diverges" in lost["fast"]
    doomed.add("slow")
    with pytest.raises(SimulationDiverged, match=r"all fit trials \(slow, fast\)"):
        compare_trials(trials, twin, calibration.fit.coefficients, phases, {})


def test_the_summary_is_the_mean_over_the_trials_of_a_role(calibration: Calibration) -> None:
    slow, fast, new = calibration.trials
    fitted, held_out = calibration.summary("fit"), calibration.summary("holdout")
    assert fitted is not None
    assert held_out is not None

    assert fitted.marker_error_mm == pytest.approx(500 * (slow.scores.marker_error_m + fast.scores.marker_error_m))
    assert held_out.speed_mae_twin == pytest.approx(abs(new.speed_twin - new.measured.speed))
    assert held_out.speed_mae_ebt == pytest.approx(abs(new.speed_ebt - new.measured.speed))
    assert calibration.summary("nothing") is None


def test_all_models_are_compared_over_the_trials_whose_tail_tip_is_seen(calibration: Calibration) -> None:
    slow, fast, _ = calibration.trials
    hidden = replace(fast, speeds=fast.speeds | {"published": np.nan})
    found = summarise([slow, hidden])
    assert found is not None

    assert (found.compared, found.trials) == (1, 2)
    assert found.speed_mae == summarise([slow]).speed_mae  # type: ignore[union-attr]
    assert summarise([hidden]).speed_mae_twin == pytest.approx(abs(fast.speed_twin - fast.measured.speed))  # type: ignore[union-attr]


def test_forecasts_of_all_models_are_compared_over_the_same_trials(calibration: Calibration) -> None:
    forecasts = calibration.forecasts
    new = forecasts.trials["new"]
    hidden = replace(new, forecasts={**new.forecasts, "ebt_published": Forecast(np.nan)})
    both = replace(forecasts, trials={**forecasts.trials, "hidden": hidden})

    assert np.isnan(both.mean("ebt_published", "speed_error"))
    assert both.compared.held_out == (new,)
    assert forecasts.compared.held_out == (new,)


@pytest.mark.long
def test_trials_beyond_the_fitted_speeds_are_flagged(trials: dict[str, MeasuredTrial]) -> None:
    within, fast = trials["new"], trials["fast"]
    beyond = replace(fast, role="holdout", known=fast.time_s < fast.warmup_s)
    compared = calibrate([trials["slow"], replace(within, role="fit"), beyond], assumed(load_robot()), STARTS).trials

    assert "extrapolated" not in [flag.kind for flag in compared[1].flags]
    (flag,) = [flag for flag in compared[2].flags if flag.kind == "extrapolated"]
    assert "1.200 Hz is outside the fitted 0.800 to 1.000 Hz" in flag.message


@pytest.mark.long
def test_a_fit_trial_with_nothing_to_compare_is_refused_by_name(trials: dict[str, MeasuredTrial]) -> None:
    slow = trials["slow"]
    lost = slow.seen_as(weight=np.where(slow.scored[:, None], 0.0, slow.weight))
    with pytest.raises(NotEnoughData, match="trial slow: nose and neck are seen together in 0 of"):
        calibrate([lost, trials["fast"]], assumed(load_robot()), STARTS)


def test_without_a_fit_trial_there_is_nothing_to_fit(trials: dict[str, MeasuredTrial]) -> None:
    with pytest.raises(NotEnoughData, match='no swim has role = "fit"'):
        calibrate([trials["new"]], assumed(load_robot()), STARTS)


def test_trials_that_do_not_show_the_tail_tip_are_left_out_of_ebt(trials: dict[str, MeasuredTrial]) -> None:
    robot = load_robot()
    slow, fast = trials["slow"], trials["fast"]
    weight = slow.weight.copy()
    weight[:, -1] = 0.0
    tails = [measured_tail(trial, trial.kept) for trial in (slow.seen_as(weight=weight), fast)]
    for form in FORMS:
        alone = fit_ebt(form, tails[1:], np.array([fast.speed]), robot)
        both = fit_ebt(form, tails, np.array([slow.speed, fast.speed]), robot)
        assert both.drag_coefficient == alone.drag_coefficient

        none = fit_ebt(form, tails[:1], np.array([slow.speed]), robot)
        assert np.isnan(none.drag_coefficient)
        assert "usable together in no fit trial" in none.flags[0].message


def test_the_sweep_gives_the_speed_a_long_swim_settles_at(swims: Swims, calibration: Calibration) -> None:
    true = swims.trials[0]
    sweep = sweep_speed(
        swims.twin, calibration.coefficients, calibration.ebts, np.array([true.frequency.hz, 1.1]), (0.8, 1.2)
    )

    assert sweep.speed_twin[0] == pytest.approx(calibration.trials[0].speed_twin, rel=0.15)
    assert sweep.speed_twin[1] > sweep.speed_twin[0] > 0
    assert sweep.ebt.keys() == {form.name for form in FORMS}
    np.testing.assert_array_equal(sweep.speed_ebt, sweep.ebt["published"])
