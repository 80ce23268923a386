"""What is doubted of the robot moves features as a robot made so does, and by as much as it is doubted."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.session_model import SessionModel
from fitting.structure import UNMEASURED_SD, Source, assumed, uncertainties_of
from fitting.trial_model import sensitivities_together
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS
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
    return sensitivities_together(model.trials[:1], TRUTH)[0].robot


def test_what_was_measured_is_free_by_its_standard_error() -> None:
    assert [doubt.sd for doubt in uncertainties_of(measured(0.004))] == pytest.approx([0.004] * 3)
    assert {doubt.source.quantity: doubt.sd for doubt in uncertainties_of(assumed(ROBOT).sources)} == UNMEASURED_SD


@pytest.mark.parametrize("which", range(3))
def test_it_moves_a_features_as_a_robot_made_so(model: SessionModel, robot: np.ndarray, which: int) -> None:
    doubt = uncertainties_of(assumed(ROBOT).sources)[which]
    twins = [exact_twin().of_robot(doubt.robot(ROBOT, sign * doubt.sd / 2)) for sign in (1, -1)]
    more, less = (SessionModel.of(twin, [model.trials[0].trial]).simulated(TRUTH[None])[0] for twin in twins)
    column = robot[:, which]
    expected = more - less
    assert column[1:] == pytest.approx(expected[1:], abs=0.1 * np.abs(expected[1:]).max())
    assert column[0] == pytest.approx(expected[0], abs=3e-4)  # m/s; the twin is a little rough
