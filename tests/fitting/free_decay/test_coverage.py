"""Over many decays: the intervals cover what they say, and the estimates are as close as asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from fitting.decay_fit import fit_decay
from fitting.free_decay import measure_decay_trial
from fitting.hinges import DecayFit, HingeEstimate, combine_decays
from tests.fitting.free_decay.decays import CAMERA, ROBOT, Truth, filmed, swings

BENT = np.array(Truth().bent_rad)
RELEASED_TOGETHER = 10  # simulated in one batch


class Study(NamedTuple):
    """Relative errors and their standard errors (s, 2) of stiffness and damping."""

    error: np.ndarray
    se: np.ndarray

    @property
    def coverage(self) -> np.ndarray:
        return (np.abs(self.error) < 1.96 * self.se).mean(axis=0)


def drawn(random: np.random.Generator, damping: float, seconds: float) -> Truth:
    """A decay with hinges, pose and release of its own."""
    bent = random.choice([-1, 1]) * random.uniform(0.8, 1.3) * BENT + random.normal(0, 0.03, 5)
    return Truth(
        stiffness_n_m=0.65 * float(np.exp(random.uniform(-0.4, 0.4))),
        damping_n_m_s=damping * float(np.exp(random.uniform(-0.3, 0.3))),
        bent_rad=tuple(bent),
        release_s=0.5 + random.uniform(0, 1 / 60),
        seconds=seconds,
    )


def study(count: int, seed: int, damping: float, seconds: float) -> Study:
    random = np.random.default_rng(seed)
    truths = [drawn(random, damping, seconds) for _ in range(count)]
    return judged(truths, fitted(truths, seed))


def combined(count: int, together: int, seed: int, damping: float, seconds: float) -> tuple[list[Truth], Study]:
    """As many robots, each let go several times, bent otherwise every time, and what is found of them."""
    random = np.random.default_rng(seed)
    robots = [drawn(random, damping, seconds) for _ in range(count)]
    truths = []
    for robot in robots:
        hinges = {"stiffness_n_m": robot.stiffness_n_m, "damping_n_m_s": robot.damping_n_m_s}
        truths += [replace(drawn(random, damping, seconds), **hinges) for _ in range(together)]
    fits = fitted(truths, seed)
    return robots, judged(robots, [combine_decays(fits[i : i + together]) for i in range(0, len(fits), together)])


def damped(truth: Truth) -> float:
    """Damping ratio over that of the built-in robot."""
    own = truth.damping_n_m_s / np.sqrt(truth.stiffness_n_m)
    return own / (ROBOT.tail.hinge_damping_n_m_s / np.sqrt(ROBOT.tail.hinge_stiffness_n_m))


def fitted(truths: list[Truth], seed: int) -> list[DecayFit]:
    groups = [truths[i : i + RELEASED_TOGETHER] for i in range(0, len(truths), RELEASED_TOGETHER)]
    places = [place for group in groups for place in swings(group)]
    tracks = [filmed(p, truth, 1000 * seed + i) for i, (truth, p) in enumerate(zip(truths, places, strict=True))]
    return [fit_decay(measure_decay_trial("d", one, CAMERA, ROBOT), ROBOT, workers=1) for one in tracks]


def judged(truths: list[Truth], estimates: Sequence[DecayFit | HingeEstimate]) -> Study:
    found = np.array([(one.stiffness_n_m, one.damping_n_m_s) for one in estimates])
    se = np.array([(one.stiffness_se_n_m, one.damping_se_n_m_s) for one in estimates])
    return Study(np.log(found / [(truth.stiffness_n_m, truth.damping_n_m_s) for truth in truths]), se / found)


@pytest.mark.long
def test_intervals_cover_over_four_hundred_decays() -> None:
    ringing, damped = study(200, 21, 0.006, 2.5), study(200, 22, 0.02, 2.0)
    together = Study(*(np.concatenate(parts) for parts in zip(ringing, damped, strict=True)))

    assert ((together.coverage > 0.92) & (together.coverage < 0.98)).all(), together.coverage
    assert np.abs(ringing.error[:, 0]).max() < 0.01
    assert np.abs(together.error[:, 1]).max() < 0.10
    # Hinges as damped as the published ones ring for one period: a single decay holds no more than about 1 %.
    assert np.median(np.abs(damped.error[:, 0])) < 0.01
    assert (np.abs(together.error) < 4.5 * together.se).all()
    assert np.abs(together.error.mean(axis=0)).max() < 0.002


@pytest.mark.long
def test_three_decays_together_hold_one_per_cent() -> None:
    """120 robots, each let go three times.

    Those damped more than the built-in one ring for less than a period, and three decays of theirs do not hold 1 % in
    95 of 100 cases; that nine in ten of all robots do is what is asked of them. The intervals hold for all.
    """
    robots, found = combined(120, 3, 32, 0.02, 2.0)
    within = np.abs(found.error) < [0.01, 0.10]
    rings = np.array([damped(robot) <= 1.0 for robot in robots])

    assert within[rings, 0].mean() >= 0.95
    assert within[:, 0].mean() >= 0.90
    assert within[:, 1].all()
    assert ((found.coverage > 0.92) & (found.coverage < 0.98)).all(), found.coverage
