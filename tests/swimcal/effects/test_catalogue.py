"""What holds for every effect, whatever it is."""

from typing import get_args

import numpy as np
import pytest
from scipy.stats import qmc

from swimcal.effects.affected_twin import AffectedRuns, AffectedTwin
from swimcal.effects.catalogue import catalogue
from swimcal.effects.effect import Effect, Family, Stage
from swimcal.mjcf import FluidCoefficients
from swimcal.session_file import TrialKind
from tests.swimcal.effects.swims import EVEN, PLAIN, TIME_S, plain_runs, runs_with, with_effect

EFFECTS = list(catalogue().values())


def named(effect: Effect) -> str:
    return effect.name


@pytest.fixture(scope="module")
def plain() -> np.ndarray:
    return PLAIN.simulate(plain_runs(), TIME_S).marker_m


@pytest.mark.parametrize("effect", EFFECTS, ids=named)
def test_it_says_what_it_is(effect: Effect) -> None:
    assert effect.family in get_args(Family)
    assert effect.stage in get_args(Stage)
    assert effect.seen_in
    assert effect.seen_in <= set(get_args(TrialKind))
    assert "\n" not in effect.physics
    assert effect.physics.endswith((".", "of."))
    assert len(effect.source) > 10
    assert effect.enters()
    names = [parameter.name for parameter in effect.parameters]
    assert names
    assert len(set(names)) == len(names)
    for parameter in effect.parameters:
        assert parameter.low <= 0 < parameter.high
        assert 0 < parameter.sd <= parameter.high


@pytest.mark.parametrize("effect", EFFECTS, ids=named)
def test_at_zero_it_is_the_plain_twin_to_the_bit(effect: Effect, plain: np.ndarray) -> None:
    nothing = np.zeros(len(effect.parameters))
    simulated, observed = with_effect(effect, nothing)
    assert np.array_equal(simulated, plain)
    assert np.array_equal(observed, plain)
    assert effect.turned_hz(0.8, nothing) == effect.measured_hz(0.8, nothing) == 0.8
    assert np.array_equal(effect.clock(TIME_S, nothing), TIME_S)
    if effect.in_mjcf():
        coefficients = FluidCoefficients(*EVEN["coefficients"][0])
        affected = AffectedTwin(PLAIN, [effect])
        changed, same = (
            AffectedTwin(PLAIN, e).spec(coefficients, v) for e, v in (([effect], nothing), ([], nothing[:0]))
        )
        changed.compile(), same.compile()
        assert changed.to_xml() == same.to_xml()
        assert affected.size == len(effect.parameters)


@pytest.mark.parametrize("effect", EFFECTS, ids=named)
def test_each_of_its_parameters_does_something(effect: Effect, plain: np.ndarray) -> None:
    alone = np.diag([parameter.sd for parameter in effect.parameters])
    pairs = [(row, 0 * row) for row in alone]
    if effect.name == "hull_roll":  # without a roll there is no natural frequency
        pairs[1] = (alone.sum(axis=0), alone[0])
    for parameter, (values, without) in zip(effect.parameters, pairs, strict=True):
        simulated, observed = with_effect(effect, values)
        before = with_effect(effect, without) if without.any() else (plain, plain)
        seen = max(np.abs(simulated - before[0]).max(), np.abs(observed - before[1]).max())
        hertz = abs(effect.measured_hz(effect.turned_hz(0.8, values), values) - 0.8)
        assert seen > 1e-5 or hertz > 1e-3, parameter.name


@pytest.mark.parametrize("effect", EFFECTS, ids=named)
def test_values_of_one_simulation_do_not_reach_another(effect: Effect) -> None:
    strong = np.array([parameter.sd for parameter in effect.parameters])
    affected = AffectedTwin(PLAIN, [effect])
    mixed = AffectedRuns(**EVEN, values=np.vstack([strong, 0 * strong, strong]))
    simulated, all_strong = affected.simulate(mixed, TIME_S), affected.simulate(runs_with(strong), TIME_S)
    assert np.array_equal(simulated.marker_m[[0, 2]], all_strong.marker_m[[0, 2]])
    assert np.array_equal(simulated.marker_m[1], PLAIN.simulate(plain_runs(), TIME_S).marker_m[1])


@pytest.mark.long
@pytest.mark.parametrize("effect", EFFECTS, ids=named)
def test_nothing_diverges_within_its_bounds(effect: Effect) -> None:
    """Over the ends of each parameter and the whole box; a tenth may diverge, where the twin is at its limit."""
    low, high = (np.array([getattr(p, end) for p in effect.parameters]) for end in ("low", "high"))
    ends = np.vstack([np.diag(low), np.diag(high), low, high])
    ends = ends[np.abs(ends).sum(axis=1) > 0]
    coefficients = np.vstack([np.tile(EVEN["coefficients"][0], (5, 1)), 10 * qmc.Sobol(5, seed=0).random(16)])
    count = len(ends) * len(coefficients)
    runs = AffectedRuns(
        coefficients=np.repeat(coefficients, len(ends), axis=0),
        frequency_hz=np.resize([0.5, 0.8, 1.1, 1.5], count),
        phase_rad=np.linspace(0, 6, count),
        values=np.tile(ends, (len(coefficients), 1)),
    )
    simulated = AffectedTwin(PLAIN, [effect]).simulate(runs, np.arange(0.0, 4.0, 1 / 30), allow_divergence=True)
    assert not simulated.diverged[: 5 * len(ends)].any()
    assert simulated.diverged.mean() <= 0.1


def test_effects_act_together() -> None:
    first, second = (catalogue()[name] for name in ("crank_arm_error", "joint_friction"))
    both, runs = AffectedTwin(PLAIN, [first, second]), runs_with(np.array([0.05, 0.03]))
    together = both.simulate(runs, TIME_S).marker_m
    alone = [with_effect(effect, value)[0] for effect, value in ((first, np.array([0.05])), (second, np.array([0.03])))]
    assert all(np.abs(together - one).max() > 1e-4 for one in alone)


def test_values_that_are_not_those_of_the_effects_are_refused() -> None:
    with pytest.raises(ValueError, match="values"):
        AffectedTwin(PLAIN, [catalogue()["joint_friction"]]).simulate(runs_with(np.zeros(2)), TIME_S)
