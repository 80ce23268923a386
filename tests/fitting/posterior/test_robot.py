"""What trials ask of the robot is found together with the coefficients, and flagged where it is much."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from fitting.posterior.posterior import Posterior, robot_flags, robot_parts
from fitting.structure import assumed, uncertainties_of
from swimcal.robot import load_robot

NOISE = 0.1**2


def known_posterior(nuisance: float) -> Posterior:
    """Of a row of numbers that is the sum of a coefficient and a crank arm, and one that is the arm, with noise."""
    columns = np.array([[1.0], [1.0]])
    likelihood = SimpleNamespace(emulator=lambda c: np.column_stack([c[:, 0], np.zeros(len(c))]))
    coefficients = np.zeros((20000, 5))
    coefficients[:, 0] = 3.0 + np.sqrt(2 * NOISE) * np.random.default_rng(0).standard_normal(20000)
    doubt = uncertainties_of(assumed(load_robot()).sources)[2]
    trial = SimpleNamespace(doubted=(SimpleNamespace(doubt=doubt),))
    mode = SimpleNamespace(
        blocks=(SimpleNamespace(sensitivities=SimpleNamespace(robot=columns)),),
        total=columns @ columns.T + NOISE * np.eye(2),
        model=SimpleNamespace(measured=np.array([3.0 + nuisance, nuisance]), trials=(trial,)),
    )
    found = SimpleNamespace(mode=mode, surrogate=SimpleNamespace(likelihood=likelihood), coefficients=coefficients)
    return cast(Posterior, found)


def test_it_is_found_together_with_the_coefficients() -> None:
    (part,) = robot_parts(known_posterior(0.5))
    assert part.quantity == "crank_arm"
    assert part.mean_after == pytest.approx(0.5 * part.sd, abs=0.01 * part.sd)
    assert part.sd_after == pytest.approx(0.1 * part.sd, rel=0.05)


@pytest.mark.parametrize(("off_sd", "warns"), [(1.5, False), (-1.5, False), (2.5, True), (-2.5, True)])
def test_trials_that_ask_for_another_robot_are_flagged(off_sd: float, warns: bool) -> None:
    flags = robot_flags(robot_parts(known_posterior(off_sd)))
    assert [flag.kind for flag in flags] == ["robot_off"] * warns
    assert all(f"crank arm {2 * off_sd:+.0f} % off" in flag.message for flag in flags)
