"""All effects at once: called for where many small ones are there, and only there; and it forecasts better then."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from diagnosis.constants import CALLED_FOR, SHARES
from diagnosis.held_out import HeldOut
from diagnosis.linear_model import LinearModel
from diagnosis.refit import Refit, likeliest_share, ridge_fit
from fitting.dry_run import with_arm
from fitting.signatures import Signature, little, signature_of
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.catalogue import catalogue
from swimcal.twin import Twin
from tests.diagnosis.linear_models import AT, CAMERA, ROBOT, linear
from tests.fitting.exact_swims import exact_swims

NAMES = ("stiffness_error", "bend_offset", "joint_damping", "crank_arm_error", "tendon_slack", "tracker_drift")


@lru_cache(maxsize=1)
def signatures() -> tuple[Signature, ...]:
    at = linear()
    return tuple(signature_of(catalogue()[name], at.model, CAMERA, at.at) for name in NAMES)


@lru_cache(maxsize=4)
def simulated(name: str, size: float) -> Signature:
    at, effect = linear(), catalogue()[name]
    values = size * np.diag([parameter.sd for parameter in effect.parameters])
    return signature_of(effect, at.model, CAMERA, at.at, values)


def columns() -> np.ndarray:
    """(k, p) what a standard deviation of each parameter does."""
    told = [
        parameter.sd * slope
        for each in signatures()
        for number, parameter in enumerate(each.effect.parameters)
        if (slope := little(each, number)) is not None
    ]
    return np.array(told).T


def noise(random: np.random.Generator) -> np.ndarray:
    return np.asarray(np.linalg.cholesky(linear().covariance) @ random.standard_normal(len(linear().residual)))


def leaving(left: np.ndarray) -> LinearModel:
    """The same swims, of which the plain twin leaves this (k,)."""
    return linear().with_residual(left)


@pytest.mark.long
def test_of_noise_nothing_is_made() -> None:
    for seed in range(12):
        at = leaving(noise(np.random.default_rng([seed, 41])))
        assert ridge_fit(at, signatures(), catalogue(), Refit.plain(at), 1) is None


@pytest.mark.parametrize("share", [0.35, 1.0])
def test_how_strong_many_small_effects_are_is_found(share: float) -> None:
    off = []
    for seed in range(12):
        random = np.random.default_rng([seed, 43])
        at = leaving(noise(random) + share * columns() @ random.standard_normal(columns().shape[1]))
        found, gained = likeliest_share(at, signatures(), Refit.plain(at))
        assert gained > 0
        off.append(np.log2(found / share))
    assert np.abs(off).max() <= 1.0  # few parameters
    assert abs(np.mean(off)) < 0.5


def test_what_is_named_is_not_called_for_again_however_it_bends() -> None:
    """What a strong effect does is not what a little of it does, larger."""
    strong = simulated("tendon_slack", 3.0)
    at = leaving(noise(np.random.default_rng(47)) + strong.rows[0])
    assert likeliest_share(at, signatures(), Refit.plain(at))[1] > CALLED_FOR
    named = replace(
        Refit.plain(at), effects=(strong.effect,), values=strong.values[0], residual=at.residual - strong.rows[0]
    )
    assert likeliest_share(at, signatures(), named)[1] < CALLED_FOR


@pytest.mark.long
def test_a_robot_with_several_things_amiss_is_forecast_better() -> None:
    softer = ROBOT.tail.model_copy(update={"hinge_stiffness_n_m": 0.7 * ROBOT.tail.hinge_stiffness_n_m})
    described = with_arm(ROBOT, 0.9 * ROBOT.crank.arm_m).model_copy(update={"tail": softer})
    *fitted, held = exact_swims(hz=(0.7, 1.1, 0.9), seconds=4.0, noise_m=3e-4)
    twin = Twin(described, FISHSIM_MARKERS, workers=1)
    at = LinearModel.of(fitted, twin, CAMERA, linear().discrepancy, AT)
    told = [signature_of(catalogue()[name], at.model, CAMERA, at.at) for name in NAMES]
    found = ridge_fit(at, told, catalogue(), Refit.plain(at), 4)
    assert found is not None
    assert found.share in SHARES
    assert found.strengths["crank_arm_error", "relative"] > 1
    gap = HeldOut(at, (held.with_role("holdout"),), 0).gap(found.refit)
    assert gap.squares_after < 0.5 * gap.squares_before
