"""What the effects of the structure do to the tail."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from swimcal.effects.catalogue import catalogue
from swimcal.effects.structure import CREEP_RAD_S, DryFriction
from swimcal.mjcf import DRY, FREE_DECAY, SWIM
from tests.swimcal.effects.models import model_with, plain_model, settled
from tests.swimcal.engine_state import at_pose
from tests.swimcal.robots import FISH

OFFSET = catalogue()["bend_offset"]
WATER = catalogue()["entrained_water"]
DAMPING = catalogue()["joint_damping"]
MASS = catalogue()["mass_distribution"]
STIFFNESS = catalogue()["stiffness_error"]
GRADIENT = catalogue()["stiffness_gradient"]
HARDENING = catalogue()["stiffness_hardening"]

FINE = replace(FREE_DECAY, timestep_s=2.5e-4)
LAST = np.array([0.0, 0.0, 0.0, 0.0, 1.0])
FIRST_MODE = np.array([0.040, 0.034, 0.026, 0.016, 0.008])  # nearly; rad


def decay(model: mujoco.MjModel, seconds: float = 1.2) -> np.ndarray:
    """(s,) bend of the whole tail after its release, rad."""
    data = mujoco.MjData(model)
    data.qpos[-5:] = FIRST_MODE
    bend = []
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
        bend.append(data.qpos[-5:].sum())
    return np.array(bend)


def undamped_hz(model: mujoco.MjModel) -> float:
    """From the zeros of a free decay without damping."""
    model.dof_damping[:] = 0.0
    bend = decay(model)
    zeros = np.flatnonzero(np.diff(np.sign(bend)))
    exact = zeros + bend[zeros] / (bend[zeros] - bend[zeros + 1])
    return float(1 / (2 * np.diff(exact).mean() * model.opt.timestep))


def test_stiffer_hinges_raise_the_frequency_by_the_square_root() -> None:
    ratio = undamped_hz(model_with(STIFFNESS, 0.44, FINE)) / undamped_hz(plain_model(FINE))
    assert ratio == pytest.approx(1.2, rel=0.01)


def test_mass_moved_to_the_tail_keeps_the_total_and_lowers_the_frequency_by_the_square_root() -> None:
    plain, other = plain_model(FINE), model_with(MASS, [0.02, 0.0, 0.0], FINE)
    assert other.body_mass.sum() == pytest.approx(plain.body_mass.sum(), rel=1e-12)
    tail = [plain.body(name).id for name in FISH.hinges]
    heavier = other.body_mass[tail] / plain.body_mass[tail]
    moved = 0.02 * sum(part.mass_kg for part in FISH.head.part)
    np.testing.assert_allclose(heavier, 1 + moved / plain.body_mass[tail].sum(), rtol=1e-9)
    assert undamped_hz(other) / undamped_hz(plain) == pytest.approx(heavier[0] ** -0.5, rel=0.01)


@pytest.mark.parametrize(
    ("shares", "geom"), [([0.0, 0.01, 0.0], f"{FISH.hinges[-1]}_plate"), ([0.0, 0.0, 0.01], "caudal_fin")]
)
def test_mass_moved_to_the_tip_is_on_the_last_link_alone_and_keeps_the_total(shares: list[float], geom: str) -> None:
    plain, other = plain_model(FINE), model_with(MASS, shares, FINE)
    assert other.body_mass.sum() == pytest.approx(plain.body_mass.sum(), rel=1e-12)
    tail = [plain.body(name).id for name in FISH.hinges]
    moved = 0.01 * sum(part.mass_kg for part in FISH.head.part)
    np.testing.assert_allclose(other.body_mass[tail] - plain.body_mass[tail], moved * LAST, atol=1e-12)
    at = plain.geom(geom).pos[0]
    nearer = (at - other.body_ipos[tail[-1], 0]) / (at - plain.body_ipos[tail[-1], 0])
    assert nearer == pytest.approx(plain.body_mass[tail[-1]] / other.body_mass[tail[-1]], rel=1e-9)


def test_damping_sets_the_rate_of_decay() -> None:
    """All hinges alike: c proportional to k, so the first mode decays at c w^2 / (2 k), w its undamped frequency."""
    w = 2 * np.pi * undamped_hz(plain_model(FINE))
    for relative in (-0.5, 0.0):
        model = model_with(DAMPING, relative, FINE)
        bend = decay(model)
        rate = FISH.tail.hinge_damping_n_m_s * (1 + relative) * w**2 / (2 * FISH.tail.hinge_stiffness_n_m)
        period = 2 * np.pi / np.sqrt(w**2 - rate**2)
        at = np.argmin(bend[: round(0.8 * period / FINE.timestep_s)])  # half a period after the release
        later = bend[at + round(period / FINE.timestep_s)]
        assert np.log(bend[at] / later) / period == pytest.approx(rate, rel=0.04)


def test_a_gradient_keeps_the_mean_stiffness() -> None:
    stiffness = model_with(GRADIENT, 0.4).jnt_stiffness[-5:] / FISH.tail.hinge_stiffness_n_m
    np.testing.assert_allclose(stiffness, [0.6, 0.8, 1.0, 1.2, 1.4])


@pytest.mark.parametrize("angle", [-0.6, 0.1, 0.6])
def test_hardening_adds_a_cubic_torque_of_either_sign(angle: float) -> None:
    data = at_pose(model_with(HARDENING, 3.0), dict.fromkeys(FISH.hinges, angle))
    expected = -FISH.tail.hinge_stiffness_n_m * angle * (1 + 3.0 * angle**2)
    np.testing.assert_allclose(data.qfrc_spring[-5:], expected)


def test_without_tendons_the_tail_rests_at_its_offset() -> None:
    np.testing.assert_allclose(settled(model_with(OFFSET, 0.1)).qpos[-5:], 0.1, atol=1e-3)


def test_dry_friction_holds_up_to_its_torque() -> None:
    """A hinge without spring creeps at w from torque / friction = w / sqrt(w^2 + w_0^2); beyond it runs away."""
    friction, seconds = 0.1, 0.2
    model = model_with(STIFFNESS, 0.0)
    model.jnt_stiffness[:] = model.dof_damping[:] = 0.0
    damper = DryFriction(np.full((1, 5), friction))
    held, free = (settled(model, seconds, share * friction * LAST, damper=damper) for share in (0.8, 2.0))
    assert held.qvel[-1] == pytest.approx(CREEP_RAD_S * 0.8 / 0.6, rel=0.02)
    assert held.qpos[-1] < seconds * CREEP_RAD_S * 0.8 / 0.6
    assert np.abs(free.qvel).max() > 20 * held.qvel[-1]


def about_hinge(model: mujoco.MjModel, body: str) -> float:
    """Moment of inertia of a body alone about its origin, about the vertical, kg m^2."""
    link, rotation = model.body(body), np.zeros(9)
    mujoco.mju_quat2Mat(rotation, link.iquat)
    upright = rotation.reshape(3, 3)[2]
    return float(upright**2 @ link.inertia + link.mass[0] * (link.ipos[:2] ** 2).sum())


def test_water_weighs_its_volume_in_water_alone() -> None:
    """A plate of 2 L x 2 h carries 2 t rho L h 4 in layers of t; alike along and across."""
    thickness, body = 0.003, "tail_2"
    plain, wet = plain_model(SWIM), model_with(WATER, thickness, SWIM)
    half = FISH.tail.segment[1].half_height_m
    length = FISH.hinge_x_m[2] - FISH.hinge_x_m[1]
    water = 2 * thickness * 1000.0 * length * 2 * half
    assert wet.body(body).mass[0] - plain.body(body).mass[0] == pytest.approx(water)
    thin = FISH.tail.segment[1].thickness_m
    expected = water * ((length**2 + thin**2) / 12 + (length / 2) ** 2)
    assert about_hinge(wet, body) - about_hinge(plain, body) == pytest.approx(expected)
    np.testing.assert_array_equal(model_with(WATER, thickness, DRY).body_mass, plain_model(DRY).body_mass)
