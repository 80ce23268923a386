"""Speed errors with their intervals: the number lies in it, and it knows how few trials there are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fitting import CalibratedTrial, MeasuredTrial, speed_errors
from fitting.scoring import Scores
from tests.fitting.swims import by_hand, head_frame_of, straight_swim
from tests.fitting.test_speed import errors_of_tracks

FRAMES, FPS, SPEED = 181, 60.0, 0.1


def measured(seed: int, noise: float = 1.0) -> MeasuredTrial:
    """A swim of three beats whose path is known to a millimetre."""
    position = straight_swim(FRAMES, SPEED, FPS)
    position[..., 0] += noise * errors_of_tracks(FRAMES, 6.0, np.random.default_rng(seed))[:, None]
    return by_hand(position, fps=FPS, speed=SPEED)


def trials(errors: Sequence[float], noise: float = 1.0) -> list[CalibratedTrial]:
    """Trials whose twin is off by so much, and whose theory by twice as much, m/s."""
    made = []
    for i, error in enumerate(errors):
        trial = replace(measured(i, noise), name=f"trial {i}")
        speeds = {"twin": SPEED + error, "published": SPEED + 2 * error}
        still, scores = head_frame_of(trial.position_m), Scores(0.0, 0.0, 0.0, 1.0)
        made.append(CalibratedTrial(trial, still, 0.0, 1.0, scores, speeds, ()))
    return made


@given(errors=st.lists(st.floats(-0.05, 0.05), min_size=1, max_size=5))
@settings(max_examples=20, deadline=None)
def test_values_are_those_of_the_trials_and_intervals_are_in_order(errors: list[float]) -> None:
    found = speed_errors(trials(errors))

    assert list(found) == ["twin", "published"]
    for name, factor in (("twin", 1), ("published", 2)):
        wanted = factor * np.array(errors)
        values = (np.abs(wanted).mean(), wanted.mean(), np.abs(wanted).max())
        assert [interval.value for interval in found[name]] == pytest.approx(values, abs=1e-12)
        for interval in found[name]:
            assert interval.low <= interval.high


def test_many_trials_of_one_error_leave_a_narrow_interval() -> None:
    bias = speed_errors(trials([0.02] * 6))["twin"].bias

    assert bias.low < 0.02 < bias.high
    assert 0 < bias.high - bias.low < 0.004


def test_without_measurement_error_one_trial_says_nothing_of_others() -> None:
    (errors,) = [speed_errors(trials([0.02], noise=0.0))["twin"]]

    for interval in errors:
        assert interval == pytest.approx((0.02, 0.02, 0.02), abs=1e-9)


def test_the_spread_of_trials_widens_the_interval() -> None:
    close, apart = (speed_errors(trials(e))["twin"].bias for e in ([0.01, 0.012, 0.008], [0.01, 0.06, -0.04]))

    assert apart.high - apart.low > 5 * (close.high - close.low)
    assert apart.low < apart.value < apart.high


@pytest.mark.long
def test_the_interval_of_the_bias_holds_the_mean_it_was_drawn_from() -> None:
    """Ten trials; a percentile bootstrap of few trials is a little too narrow."""
    random = np.random.default_rng(0)
    made = trials([0.0] * 10)
    hits = 0
    for _ in range(100):
        drawn = [
            replace(trial, speeds={"twin": SPEED + 0.01 + error})
            for trial, error in zip(made, random.normal(0, 0.02, 10), strict=True)
        ]
        bias = speed_errors(drawn)["twin"].bias
        hits += bias.low <= 0.01 <= bias.high

    assert 78 <= hits <= 96


def test_the_seed_decides_the_interval_and_no_order_of_trials() -> None:
    made = trials([0.01, -0.02, 0.03])

    assert speed_errors(made, seed=1) == speed_errors(made, seed=1) != speed_errors(made, seed=2)
    assert speed_errors(made[::-1]) == speed_errors(made)
    assert speed_errors([]) == {}
