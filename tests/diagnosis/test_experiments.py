"""What is recommended would separate what is confused, as surely as it says; on swims of the twin itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from diagnosis import experiments
from diagnosis.evidence import Priors
from diagnosis.experiments import _odds, _Pair, error_residual, next_experiments, odds_over_expected
from diagnosis.hypotheses import Hypothesis, Probabilities, average_hypotheses, error_sizes
from diagnosis.result import Experiment
from diagnosis.verdict import Verdict
from fitting.signatures import signature_of
from swimcal.effects.catalogue import catalogue
from tests.diagnosis.linear_models import CAMERA, linear

CLOCK, RATIO, DAMPING = "time_base_error", "drive_ratio_error", "joint_damping"
OFF = 1.05  # times as fast as filmed the motors were told to turn


@pytest.fixture(scope="module")
def found() -> tuple[Experiment, ...]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiments, "SPEEDS_HZ", (1.1, 1.4))  # the first was swum
        return recommended((CLOCK, RATIO))


def recommended(group: tuple[str, ...]) -> tuple[Experiment, ...]:
    """For a group, of swims whose tails beat slower than the motors were told."""
    plain = linear()
    beside = tuple(
        replace(each, trial=replace(each.trial, commanded_hz=OFF * each.trial.frequency.hz))
        for each in plain.model.trials
    )
    told = replace(plain, model=type(plain.model)(beside))
    effects = {name: catalogue()[name] for name in (CLOCK, RATIO, DAMPING)}
    signatures = [signature_of(effect, told.model, CAMERA, told.at) for effect in effects.values()]
    found, verdict = (
        average_hypotheses(error_sizes(told, signatures), signatures, Priors()),
        Verdict("inseparable", (group,)),
    )
    return next_experiments(found.linear, found.hypotheses, verdict, found.probabilities, effects)


def by_text(found: tuple[Experiment, ...], text: str) -> Experiment:
    (one,) = (each for each in found if text in each.describe)
    return one


@pytest.mark.long
def test_a_log_or_a_clock_in_view_tells_clock_from_gear_and_no_swim(found: tuple[Experiment, ...]) -> None:
    log, clock = by_text(found, "Log the motor"), by_text(found, "running clock")
    assert max(log.expected_error, clock.expected_error) < 0.001
    assert log.trial is not None
    assert log.trial.logged
    assert clock.trial is None
    swim = by_text(found, "swim at 1.4 Hz")
    assert swim.expected_error > 100 * log.expected_error
    assert swim.trial is not None
    assert (swim.trial.kind, swim.trial.commanded_hz, swim.trial.logged) == ("swim", 1.4, False)


def test_swims_that_told_what_they_should_are_believed() -> None:
    assert [odds_over_expected(*seen) for seen in ((9.0, 40.0), (9.0, -32.0), (1.5, 0.0), (0.0, 0.0))] == [1.0] * 4
    assert odds_over_expected(9.0, 0.0) == pytest.approx(2 / 9)
    assert odds_over_expected(9.0, 0.0) < odds_over_expected(9.0, 10.0) < odds_over_expected(9.0, 20.0) < 1.0


@pytest.mark.long
def test_only_what_a_trial_adds_and_swims_bear_out_counts() -> None:
    """As far apart as 9 and as likely as each other: of what a swim adds counts two ninths of the square."""
    seen = iter([9.0])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiments, "SPEEDS_HZ", (1.4,))
        patch.setattr(_Pair, "apart", lambda *_: next(seen, 12.0))
        patch.setattr(experiments, "_odds", lambda *_: 0.0)
        told = recommended((CLOCK, RATIO))
    assert by_text(told, "swim at 1.4 Hz").expected_error == pytest.approx(norm.cdf(-12 * np.sqrt(2 / 9) / 2))
    assert by_text(told, "dry run").expected_error == pytest.approx(norm.cdf(-6.0))


@pytest.mark.parametrize(("distance", "log_odds"), [(0.0, 2.0), (1.0, 2.2), (3.0, -1.0), (4.0, 0.0)])
def test_the_error_left_is_that_of_choosing_the_likelier(distance: float, log_odds: float) -> None:
    """Against draws of the log likelihood ratio: normal about half the square of the distance, either way."""
    random, chance = np.random.default_rng(3), 1 / (1 + np.exp(-log_odds))
    ratio = distance * random.standard_normal(200_000)
    wrong = chance * np.mean(log_odds + distance**2 / 2 + ratio < 0)
    wrong += (1 - chance) * np.mean(log_odds - distance**2 / 2 + ratio > 0)
    assert error_residual(distance, log_odds) == pytest.approx(wrong, abs=0.004)


def test_two_that_are_probably_both_there_are_not_to_be_told_apart() -> None:
    both, one, other = Hypothesis((0, 1)), Hypothesis((0,)), Hypothesis((1,), other=True)
    found = Probabilities(("a", "b"), {both: 0.6, one: 0.25, other: 0.15})
    assert found.either_or("a", "b") == pytest.approx((0.25, 0.15, 0.6))
    assert _odds(found, ("a", "b")) is None
    fewer = Probabilities(("a", "b"), {both: 0.2, one: 0.6, other: 0.2})
    assert _odds(fewer, ("a", "b")) == pytest.approx(np.log(3.0))


def test_the_most_telling_comes_first_and_nothing_is_swum_again(found: tuple[Experiment, ...]) -> None:
    errors = [each.expected_error for each in found]
    assert errors == sorted(errors)
    assert recommended((DAMPING,)) == ()  # nothing is confused
    assert 0.0 <= min(errors) <= max(errors) <= 0.5
    assert all(set(each.separates) == {CLOCK, RATIO} for each in found)
    swum = np.array([trial.commanded_hz for trial in linear().trials])
    assert all(
        np.abs(swum - each.trial.commanded_hz).min() > 0.05
        for each in found
        if each.trial is not None and each.trial.kind == "swim" and not each.trial.logged
    )
