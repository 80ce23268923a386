"""Swims of a robot that does what its twin leaves out ask for just that, and others ask for nothing."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fitting.dry_run.response import with_arm
from fitting.model import Mode
from fitting.model.session_model import START_PHASE_RAD, SessionModel
from fitting.model.trial_model import TrialModel
from fitting.signatures import Signature
from fitting.signatures import score_tests as tested
from fitting.signatures.score_tests import EffectsLeftOut, score_tests
from fitting.signatures.session_row import row_slopes
from session import CameraSpec
from swimmer import Twin
from swimmer.effects import Effect, catalogue
from synthetic import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import ROBOT, exact_swims, exact_twin

TRUTH = np.array(PLAUSIBLE_COEFFICIENTS, float)
CAMERA = CameraSpec(fps=60.0, scale_length_m=ROBOT.scale_length_m)
EFFECTS = {name: catalogue()[name] for name in ("crank_arm_error", "scale_error", "tendon_slack", "entrained_water")}
SD = 3e-4  # of the noise of every number of features
LONGER = 0.02


class Linear:
    """The twin about the truth, which costs nothing."""

    def __init__(self, model: SessionModel) -> None:
        self.model, self.middle = model, model.simulated(TRUTH[None])[0]
        self.slopes = row_slopes(model, TRUTH)[: len(self.middle)]

    def mode(self, measured: np.ndarray) -> Mode:
        """Of measured features (k,), and the model linear about it."""
        covariance = np.linalg.inv(self.slopes.T @ self.slopes / SD**2)
        middle = TRUTH + covariance @ self.slopes.T @ (measured - self.middle) / SD**2
        mode = SimpleNamespace(
            model=self.model,
            coefficients=middle,
            coefficient_covariance=covariance,
            total=SD**2 * np.eye(len(self.middle)),
            jacobian=self.slopes,
            residual=measured - self.middle - self.slopes @ (middle - TRUTH),
        )
        return cast(Mode, mode)


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


def asked(mode: Mode) -> EffectsLeftOut:
    return score_tests(mode, CAMERA, EFFECTS.values())


def noise(linear: Linear, seed: int) -> np.ndarray:
    return SD * np.random.default_rng(seed).standard_normal(len(linear.middle))


def test_another_robot_is_found_by_effect_size_and_what_it_moves(linear: Linear) -> None:
    swum = beside(exact_twin(workers=1).of_robot(with_arm(ROBOT, (1 + LONGER) * ROBOT.crank.arm_m)))
    mode = linear.mode(swum.simulated(TRUTH[None])[0])
    best = asked(mode).tried[0]
    assert (best.effect, best.asked) == ("crank_arm_error", True)
    assert best.value == pytest.approx(LONGER, rel=0.05)
    wrong = (mode.coefficients - TRUTH) / np.sqrt(np.diag(mode.coefficient_covariance))
    assert best.moved == pytest.approx(wrong, abs=0.15 * np.abs(wrong).max())


@pytest.mark.usefixtures("once")
def test_noise_alone_asks_for_something_as_seldom_as_it_says(linear: Linear) -> None:
    found = [asked(linear.mode(linear.middle + noise(linear, seed))).tried[0] for seed in range(300)]
    assert 0.02 < np.mean([best.chance < 0.1 for best in found]) <= 0.14
    assert sum(best.asked for best in found) <= 8


@pytest.mark.usefixtures("once")
def test_an_effect_of_one_sign_is_asked_for_one_way(linear: Linear) -> None:
    slack = tested.signature_of(EFFECTS["tendon_slack"], linear.model, CAMERA, TRUTH)
    row = slack.features[int(np.argmax(slack.values[:, 0]))]
    there, missing = (asked(linear.mode(linear.middle + sign * row)).tried for sign in (1, -1))
    assert there[0].effect == "tendon_slack"
    assert there[0].value > 0
    opposite = next(each for each in missing if each.effect == "tendon_slack")
    assert opposite.z < 0
    assert opposite.value == 0


def test_what_diverges_or_moves_nothing_is_named_and_not_asked(linear: Linear, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(effect: Effect, *_: Any, **__: Any) -> Signature:
        features = np.full((1, len(linear.middle)), np.nan if effect.name == "tendon_slack" else 0.0)
        return Signature(
            effect, np.array([[parameter.sd for parameter in effect.parameters]]), features, np.zeros((1, 2))
        )

    monkeypatch.setattr(tested, "signature_of", broken)
    found = asked(linear.mode(linear.middle))
    assert (found.tried, found.flags, found.diverged) == ((), (), ("tendon_slack",))
    assert set(found.silent) == EFFECTS.keys() - {"tendon_slack"}
