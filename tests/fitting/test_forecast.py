"""What frozen coefficients say of a trial they were not fitted to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting import MeasuredTrial
from fitting.forecast import _lowest as lowest
from fitting.forecast import fit_phase, forecast
from fitting.objective import Swims
from fitting.scoring import score
from synthetic import Truth


def apart(one: float, other: float) -> float:
    """Angle between two phases, rad."""
    return abs(float(np.angle(np.exp(1j * (one - other)))))


@pytest.mark.parametrize("name", ["slow", "fast", "new"])
def test_the_phase_is_found(name: str, swims: Swims, trials: dict[str, MeasuredTrial], truth: Truth) -> None:
    found = fit_phase(swims.twin, trials[name], truth.plan.coefficients)

    assert apart(found, truth.trials[name].phase_rad) < 0.03


def test_between_tries_the_phase_is_that_of_a_parabola() -> None:
    tries = np.array([0.0, 0.1, 0.2, 0.3])
    assert lowest(tries, 2.0 * (tries - 0.13) ** 2 + 1.0) == pytest.approx(0.13)
    assert lowest(tries, 2.0 * (tries - 0.29) ** 2) == pytest.approx(0.29)
    assert lowest(tries, tries) == 0.0
    assert lowest(tries, np.array([np.inf, 1.0, 2.0, np.inf])) == 0.1
    assert lowest(tries, np.full(4, np.inf)) == 0.0


def test_markers_put_beside_their_place_do_not_move_the_phase(
    swims: Swims, trials: dict[str, MeasuredTrial], truth: Truth
) -> None:
    trial = trials["new"]
    offset = np.random.default_rng(0).normal(0.0, 0.004, (len(trial.markers), 2))
    offset[:2] = 0.0
    beside = replace(trial, head=replace(trial.head, shape_m=trial.head.shape_m + offset))

    found = [fit_phase(swims.twin, one, truth.plan.coefficients) for one in (trial, beside)]
    assert apart(*found) < 0.02


def test_a_held_out_swim_is_foretold_by_the_true_coefficients(
    swims: Swims, trials: dict[str, MeasuredTrial], truth: Truth
) -> None:
    trial = trials["new"]
    phase = fit_phase(swims.twin, trial, truth.plan.coefficients)
    simulated = forecast(swims.twin, trial, truth.plan.coefficients, phase)

    assert simulated.position_m.shape == trial.head.position_m.shape
    assert score(trial, simulated).marker_error_m < 5e-3
