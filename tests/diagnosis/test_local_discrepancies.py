"""Something that no catalogue holds is found at the one place where it acts."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from diagnosis.evidence import Priors
from diagnosis.hypotheses import Probabilities, average_hypotheses, error_sizes
from diagnosis.places import ForceResponses, LocalDiscrepancy, across, likely_of, local_discrepancies
from diagnosis.verdict import verdict_of
from fitting.signatures import signature_of
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.measurement import MarkerOffset
from swimcal.effects.structure import StiffnessGradient
from swimcal.mjcf import build_mjcf
from swimcal.robot import load_robot
from tests.cases import later
from tests.diagnosis.linear_models import CAMERA, linear
from tests.diagnosis.rows import DIRECTIONS, SPACE, K, after, hypotheses

PLACES = np.linalg.qr(np.random.default_rng(6).standard_normal((K, 60)))[0].T.reshape(6, 10, K)


def among(left: np.ndarray) -> Probabilities:
    """Of what is left (k,), where something else may be at one of six places, ten numbers each."""
    return after(hypotheses(left, places=tuple((1.0, SPACE.projected(place).T) for place in PLACES)))


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng([seed, 2]).standard_normal(K)


def test_what_is_amiss_at_one_place_is_found_there() -> None:
    gap = 9.0 * np.array([0.6, 0.0, 0.7, 0.0, 0.3, 0.0, 0.0, 0.2, 0.0, 0.1]) @ PLACES[3]
    found = among(noise(0) + gap)
    assert verdict_of(found).name == "unexplained"
    assert int(np.argmax(found.at_place)) == 3
    assert found.at_place[3] > 0.8
    assert found.other > 0.75


@pytest.mark.parametrize("seed", [1, *later(2, 3, 4)])
def test_noise_and_an_effect_that_is_there_are_at_no_place(seed: int) -> None:
    found = among(noise(seed))
    assert verdict_of(found).name == "no_gap"
    assert sum(found.at_place) < 0.3
    found = among(noise(seed) + 12.0 * DIRECTIONS[5])
    assert verdict_of(found).groups == (("effect_5",),)
    assert sum(found.at_place) < 0.2


def test_a_force_across_the_tail_is_on_its_joints_as_mujoco_says() -> None:
    robot = load_robot()
    model = build_mjcf(robot).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for place_m in (robot.hinge_x_m[0] + 0.01, robot.hinge_x_m[2] + 0.02, robot.fin_root_x_m):
        behind = int(np.sum(robot.hinge_x_m < place_m))
        body = model.body(robot.hinges[behind - 1]).id
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, data.body("head").xpos + np.array([place_m, 0.0, 0.0]), body)
        joints = [model.joint(name).dofadr[0] for name in robot.hinges]
        expected = across(float(place_m), robot.hinge_x_m)
        assert jacobian[1, :3] == pytest.approx(expected[:3], abs=1e-9)  # surge, sway, yaw
        assert jacobian[1, joints] == pytest.approx(expected[3:], abs=1e-9)


@pytest.fixture(scope="module")
def elsewhere(pushed: ForceResponses) -> tuple[LocalDiscrepancy, ...]:
    return local_discrepancies(linear(), pushed)


@pytest.mark.long
def test_a_marker_that_lags_in_its_socket_is_found_at_the_marker(elsewhere: tuple[LocalDiscrepancy, ...]) -> None:
    lagging = next(each for each in elsewhere if (each.place, each.same) == ("marker tail_4", True))
    gap = lagging.columns @ np.array([0.0, *[0.0] * 6, 0.0, 0.8, 0.5, 0.3, -0.2, 0.1, 0.2, 0.0, 0.0])
    gap *= 15 / np.linalg.norm(linear().space.projected(gap))
    here = linear().with_residual(linear().residual + gap)
    effects = (MarkerOffset(FISHSIM_MARKERS), StiffnessGradient())
    known = [signature_of(effect, here.model, CAMERA, here.at) for effect in effects]
    found = average_hypotheses(error_sizes(here, known), known, Priors(), elsewhere).probabilities
    most = elsewhere[int(np.argmax(found.at_place))]
    assert most.place == "marker tail_4"
    assert sum(p for p, each in zip(found.at_place, elsewhere, strict=True) if each.place == most.place) > 0.8


def test_of_a_place_that_is_likely_the_likeliest_is_told() -> None:
    free, common, nose = (
        LocalDiscrepancy(place, same, np.zeros((K, 1)))
        for place, same in (("hinge tail_2", False), ("hinge tail_2", True), ("marker nose", True))
    )
    assert likely_of((free, common, nose), (0.2, 0.35, 0.45)) == (common,)
    assert likely_of((free, common, nose), (0.2, 0.25, 0.55)) == (nose,)
    assert likely_of((), ()) == ()
