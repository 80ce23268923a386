"""What the effects of the tendons do to the tail."""

import mujoco
import numpy as np
import pytest

from swimcal.effects.catalogue import catalogue
from swimcal.effects.tendons import TendonPath
from swimcal.mjcf import DRY, build_mjcf
from swimcal.robot import RobotSpec
from tests.swimcal.effects.models import model_with, plain_model, settled, still
from tests.swimcal.engine_state import at_pose, random_state
from tests.swimcal.robots import FISH, every_robot

ASYMMETRY = catalogue()["tendon_asymmetry"]
COMPLIANCE = catalogue()["tendon_compliance"]
FRICTION = catalogue()["tendon_friction"]
SLACK = catalogue()["tendon_slack"]

TURN = np.linspace(-np.pi / 2, np.pi / 2, 41)


def crank_torque(model: mujoco.MjModel, crank_rad: float) -> float:
    """With which the springs of the tendons turn the crank back when the tail is held straight, N m."""
    return float(at_pose(model, {"crank": crank_rad}).qfrc_spring[0])


def lengthening(crank_rad: float) -> tuple[np.ndarray, np.ndarray]:
    """(2,) m, of the tendons on the straight tail; and (2,) m/rad, how fast it grows."""
    path, step = TendonPath(FISH), 1e-5
    length_m = path(crank_rad + step * np.array([-1.0, 0.0, 1.0]), np.zeros((3, 5))).length_m.sum(axis=-1)
    return length_m[1] - path.straight().length_m.sum(axis=-1)[0], (length_m[2] - length_m[0]) / (2 * step)


@every_robot
def test_the_path_is_the_engines(robot: RobotSpec) -> None:
    """Lengths, and by virtual work the torques of a spring: minus force times arm, in each hinge."""
    model = build_mjcf(robot, scene=DRY).compile()
    model.jnt_stiffness[:] = 0.0
    data = random_state(model, seed=3)
    spans = TendonPath(robot)(data.qpos[:1], data.qpos[None, 1:])
    np.testing.assert_allclose(spans.length_m.sum(axis=-1)[0], data.ten_length, rtol=1e-12)
    force = model.tendon_stiffness * (data.ten_length - model.tendon_lengthspring[:, 0])
    np.testing.assert_allclose(data.qfrc_spring[1:], -force @ spans.per_hinge[0], rtol=1e-9, atol=1e-9)


def test_compliance_softens_spring_and_damper() -> None:
    plain, soft = plain_model(DRY), model_with(COMPLIANCE, 3.0, DRY)
    assert crank_torque(soft, 1.0) == pytest.approx(crank_torque(plain, 1.0) / 4)
    np.testing.assert_allclose(soft.tendon_damping, plain.tendon_damping / 4)


def test_slack_leaves_a_dead_band_of_twice_its_length() -> None:
    slack, torques, expected = 0.004, [], []
    model = model_with(SLACK, [0.003, 0.001], DRY)
    for crank_rad in TURN:
        longer, per_rad = lengthening(crank_rad)
        pull = np.sign(longer) * np.maximum(np.abs(longer) - slack, 0.0) * FISH.tendons.stiffness_n_m
        torques.append(crank_torque(model, crank_rad))
        expected.append(-pull @ per_rad)
    np.testing.assert_allclose(torques, expected, atol=1e-8)
    assert 0 < sum(torque == 0.0 for torque in torques) < len(TURN) / 2


@pytest.mark.parametrize(("slack_m", "share"), [((0.004, 0.0), 1.0), ((0.001, 0.003), 0.25), ((0.0, 0.004), None)])
def test_a_loose_line_damps_by_the_share_of_its_slack_that_drags(
    slack_m: tuple[float, float], share: float | None
) -> None:
    loose = model_with(SLACK, list(slack_m), DRY)
    damper = SLACK.damping(FISH, DRY, [loose], np.array([slack_m]))
    assert (damper is None) == (share is None)
    if damper is not None and share is not None:
        taken = damper(still(np.zeros((1, 6)), np.ones((1, 6)))).tendons
        np.testing.assert_allclose(taken, -share * loose.tendon_damping[None], rtol=1e-9)


def test_friction_takes_the_power_that_sliding_through_each_guide_costs() -> None:
    """Force times how fast the way behind each guide of each line changes, in an S-bend as the lines make it."""
    force, step = 2.0, 1e-6
    path, zero = TendonPath(FISH), np.zeros(1)
    left = path.straight().per_hinge[0, 0]
    speed = 3.0 * np.sign(left) * [1.0, 1.2, 0.8, 1.1, 0.9]
    after, before = (path(zero, sign * step * speed[None]).length_m[0] for sign in (1, -1))
    per_span = (after - before) / (2 * step)  # (2, h) m/s
    sliding = [np.abs(per_span[:, guide:].sum(axis=1)).sum() for guide in range(1, 5)]
    damper = FRICTION.damping(FISH, DRY, [plain_model(DRY)], np.array([[force]]))
    given_back = FRICTION.force(FISH, DRY, np.array([[force]]))
    assert damper is not None
    assert given_back is not None
    state = still(np.zeros((1, 6)), np.concatenate([zero, speed])[None])
    lost = np.asarray(damper(state).joints)[0, 1:] @ speed**2 - given_back(state)[0, 1:] @ speed
    assert lost == pytest.approx(force * sum(sliding), rel=5e-3)


def test_an_asymmetry_bends_the_resting_tail_until_the_tendons_fit() -> None:
    shift = 0.003
    bent, mirrored = (settled(model_with(ASYMMETRY, sign * shift, DRY)) for sign in (1, -1))
    rest = plain_model(DRY).tendon_lengthspring[:, 0]
    np.testing.assert_allclose(bent.ten_length - rest, [-shift, shift], rtol=0.1)
    np.testing.assert_allclose(mirrored.qpos[1:], -bent.qpos[1:], atol=1e-4)
    assert bent.site("marker_caudal_fin").xpos[1] < -0.01  # to the left
