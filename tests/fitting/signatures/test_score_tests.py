"""Swims of a robot that does what its twin leaves out ask for just that, and others ask for nothing."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fitting.posterior import Posterior
from fitting.posterior.left_out import LeftOut
from fitting.posterior.session_model import START_PHASE_RAD, SessionModel
from fitting.posterior.trial_model import TrialModel
from fitting.signatures import score_tests as tested
from fitting.signatures.score_tests import score_tests
from fitting.signatures.session_row import row_slopes
from session import CameraSpec
from swimmer import Twin
from swimmer.effects import catalogue
from synthetic import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import ROBOT, exact_swims, exact_twin

TRUTH = np.array(PLAUSIBLE_COEFFICIENTS, float)
CAMERA = CameraSpec(fps=60.0, scale_length_m=ROBOT.scale_length_m)
EFFECTS = {name: catalogue()[name] for name in ("crank_arm_error", "scale_error", "tendon_slack", "entrained_water")}
SD = 3e-4  # of the noise of every number of a gait
LONGER = 0.02


class Linear:
    """The twin about the truth, as a stand-in that costs nothing."""

    def __init__(self, model: SessionModel) -> None:
        self.model, self.middle = model, model.simulated(TRUTH[None])[0]
        self.slopes = row_slopes(model, TRUTH)[: len(self.middle)]

    def emulator(self, coefficients: np.ndarray) -> np.ndarray:
        return np.asarray(self.middle + (coefficients - TRUTH) @ self.slopes.T)

    def covariance(self, _discrepancy: np.ndarray) -> np.ndarray:
        return SD**2 * np.eye(len(self.middle))

    def after(self, measured: np.ndarray) -> Posterior:
        """The posterior of measured gaits (k,), with draws of it."""
        normal = np.linalg.inv(self.slopes.T @ self.slopes / SD**2)
        middle = TRUTH + normal @ self.slopes.T @ (measured - self.middle) / SD**2
        draws = np.random.default_rng(0).multivariate_normal(middle, normal, 2000)
        model = SessionModel(self.model.trials)
        model.__dict__["measured"] = measured
        posterior = SimpleNamespace(
            model=model,
            found=SimpleNamespace(likelihood=self),
            coefficients=draws,
            discrepancy=np.zeros((2000, 2)),
        )
        return cast(Posterior, posterior)


def beside(twin: Twin) -> SessionModel:
    trials = exact_swims(hz=(0.7, 1.1), seconds=3.5)
    return SessionModel(tuple(TrialModel(twin, trial, START_PHASE_RAD) for trial in trials))


@pytest.fixture(scope="module")
def linear() -> Linear:
    return Linear(beside(exact_twin(workers=1)))


@pytest.fixture
def once(linear: Linear, monkeypatch: pytest.MonkeyPatch) -> None:
    """What an effect does is simulated once, at the truth."""
    of_effect = tested.signature_of

    @cache
    def same(name: str) -> Any:
        return of_effect(EFFECTS[name], linear.model, CAMERA, TRUTH, sizes=(-1.0, 1.0))

    monkeypatch.setattr(tested, "signature_of", lambda effect, *_, **__: same(effect.name))


def asked(posterior: Posterior) -> tuple[LeftOut, ...]:
    return score_tests(posterior, CAMERA, EFFECTS.values())


def noise(linear: Linear, seed: int) -> np.ndarray:
    return SD * np.random.default_rng(seed).standard_normal(len(linear.middle))


def test_another_robot_is_found_by_its_effect_its_size_and_what_it_does_to_coefficients(linear: Linear) -> None:
    crank = ROBOT.crank.model_copy(update={"arm_m": (1 + LONGER) * ROBOT.crank.arm_m})
    swum = beside(exact_twin(workers=1).of_robot(ROBOT.model_copy(update={"crank": crank})))
    posterior = linear.after(swum.simulated(TRUTH[None])[0])
    best = asked(posterior)[0]
    assert (best.effect, best.asked) == ("crank_arm_error", True)
    assert best.value == pytest.approx(LONGER, rel=0.05)
    wrong = (posterior.coefficients.mean(axis=0) - TRUTH) / posterior.coefficients.std(axis=0)
    assert best.moves * best.value / best.prior_sd == pytest.approx(wrong, abs=0.15 * np.abs(wrong).max())


@pytest.mark.usefixtures("once")
def test_noise_alone_asks_for_something_as_seldom_as_it_says(linear: Linear) -> None:
    found = [asked(linear.after(linear.middle + noise(linear, seed))) for seed in range(200)]
    z = np.array([best.z for best, *_ in found])
    assert np.mean([best.chance < 0.1 for best, *_ in found]) <= 0.14
    assert 0.5 < np.median(z) < 2.2
    assert sum(best.asked for best, *_ in found) <= 6


@pytest.mark.usefixtures("once")
def test_an_effect_of_one_sign_is_asked_for_one_way(linear: Linear) -> None:
    slack = tested.signature_of(EFFECTS["tendon_slack"], linear.model, CAMERA, TRUTH)
    row = slack.gaits[int(np.argmax(slack.values[:, 0]))]
    there, missing = (asked(linear.after(linear.middle + sign * row)) for sign in (1, -1))
    assert there[0].effect == "tendon_slack"
    assert there[0].value > 0
    assert next(each for each in missing if each.effect == "tendon_slack").z < 0
