"""What is doubted of the robot moves a gait as a robot made so does, and by as much as it is doubted."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from fitting.model.robot_doubt import UNMEASURED_SD, doubts_of
from fitting.posterior import Posterior, SessionModel
from fitting.posterior.places_off import TAKEN
from fitting.posterior.shared import SharedNuisances, robot_flags
from fitting.structure import Source, assumed
from synthetic import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import ROBOT, exact_swims, exact_twin

TRUTH = np.array(PLAUSIBLE_COEFFICIENTS, float)


def measured(se: float) -> tuple[Source, ...]:
    """As if dry experiments had given all numbers with this relative error."""
    return tuple(source._replace(se=se * source.value, trials=("dry",)) for source in assumed(ROBOT).sources)


@pytest.fixture(scope="module")
def model() -> SessionModel:
    return SessionModel.of(exact_twin(), exact_swims(hz=(1.0,), seconds=4.0))


@pytest.fixture(scope="module")
def robot(model: SessionModel) -> np.ndarray:
    return model.trials[0].freedoms(TRUTH).robot


def test_what_was_measured_is_free_by_its_standard_error() -> None:
    assert [doubt.sd for doubt in doubts_of(measured(0.004))] == pytest.approx([0.004] * 3)
    assert {doubt.source.quantity: doubt.sd for doubt in doubts_of(assumed(ROBOT).sources)} == UNMEASURED_SD


@pytest.mark.parametrize("which", range(3))
def test_it_moves_a_gait_as_a_robot_made_so(model: SessionModel, robot: np.ndarray, which: int) -> None:
    doubt = doubts_of(assumed(ROBOT).sources)[which]
    twins = [exact_twin().of_robot(doubt.robot(ROBOT, sign * doubt.sd / 2)) for sign in (1, -1)]
    more, less = (SessionModel.of(twin, [model.trials[0].trial]).simulated(TRUTH[None])[0] for twin in twins)
    column = robot[:, which]
    expected = more - less
    assert column[1:] == pytest.approx(expected[1:], abs=0.1 * np.abs(expected[1:]).max())
    assert column[0] == pytest.approx(expected[0], abs=3e-4)  # m/s; the twin is a little rough


def known_posterior(nuisance: float) -> Posterior:
    """Of a row of numbers that is the sum of a coefficient and a crank arm, and one that is the arm, with noise."""
    columns, noise = np.array([[1.0], [1.0]]), 0.1**2
    likelihood = SimpleNamespace(
        emulator=lambda c: np.column_stack([c[:, 0], np.zeros(len(c))]),
        covariance=lambda _: columns @ columns.T + noise * np.eye(2),
    )
    random = np.random.default_rng(0)
    coefficients = np.zeros((20000, 5))
    coefficients[:, 0] = 3.0 + np.sqrt(2 * noise) * random.standard_normal(20000)
    trial = SimpleNamespace(doubted=((doubts_of(assumed(ROBOT).sources)[2],),))
    posterior = SimpleNamespace(
        model=SimpleNamespace(measured=np.array([3.0 + nuisance, nuisance]), trials=(trial,)),
        found=SimpleNamespace(
            likelihood=likelihood, disturbances=SimpleNamespace(shared=lambda _marker_m: columns), off=TAKEN
        ),
        discrepancy=np.full((20000, 2), 0.01),
        coefficients=coefficients,
    )
    return cast(Posterior, posterior)


def test_what_trials_share_is_found_together_with_the_coefficients() -> None:
    posterior = known_posterior(0.5)
    coefficients, found = posterior.coefficients, SharedNuisances.of(posterior)
    drawn = found.drawn(coefficients, np.random.default_rng(1))[:, 0]

    assert drawn.mean() == pytest.approx(0.5, abs=0.01)
    assert drawn.std() == pytest.approx(0.1, rel=0.05)
    assert np.corrcoef(drawn, coefficients[:, 0])[0, 1] == pytest.approx(-np.sqrt(0.5), abs=0.03)
    assert found.with_coefficients()[5, 5] == pytest.approx(drawn.var(), rel=0.05)


@pytest.mark.parametrize(("off_sd", "warns"), [(1.5, False), (-1.5, False), (2.5, True), (-2.5, True)])
def test_swims_that_ask_for_another_robot_are_flagged(off_sd: float, warns: bool) -> None:
    flags = robot_flags(known_posterior(off_sd))
    assert [flag.kind for flag in flags] == ["robot_off"] * warns
    assert all(f"crank arm {2 * off_sd:+.0f} % off" in flag.message for flag in flags)
