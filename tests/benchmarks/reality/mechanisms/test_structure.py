import numpy as np
import pytest

from benchmarks.reality import Nuisances, Recording, Trial, World, simulate
from benchmarks.reality.mechanisms.structure import (
    BendOffset,
    EntrainedWater,
    JointDamping,
    JointFriction,
    MassDistribution,
    StiffnessError,
    StiffnessGradient,
    StiffnessHardening,
)
from tests.benchmarks.reality.mechanisms.one_fish import (
    LAYOUT,
    added,
    bent_by,
    hinge_torque,
    instant,
    of_one,
    prepared,
)
from tests.benchmarks.reality.motions import COEFFICIENTS

HINGES = np.linspace(0.02, 0.1, LAYOUT.hinges)
STIFFNESS, DAMPING = prepared().hinge_stiffness_n_m[0], prepared().hinge_damping_n_m_s[0]


@pytest.fixture(scope="module")
def decays() -> list[Recording]:
    trial = Trial("free_decay", 0.8, fps=240.0, bent_rad=(0.040, 0.034, 0.026, 0.016, 0.008))
    little = Nuisances(hinge_damping=0.1)
    kinds = (
        (),
        (StiffnessError((0.4,) * 5),),
        (MassDistribution(0.02, (0.2,) * 5),),
        (JointDamping(1.0, 1e9),),
        (EntrainedWater(0.01, 0.5),),
    )
    worlds = [World(COEFFICIENTS, little, each) for each in kinds]
    return simulate([(world, trial) for world in [*worlds, World(COEFFICIENTS, mechanisms=(BendOffset(0.03, 0.0),))]])


def hz(decay: Recording) -> float:
    bend = decay.hinges_rad.sum(axis=1)
    zeros = np.flatnonzero(np.diff(np.sign(bend)))
    exact = zeros + bend[zeros] / (bend[zeros] - bend[zeros + 1])
    return float(240 / (2 * np.diff(exact).mean()))


def test_stiffer_hinges_raise_the_frequency_by_the_square_root(decays: list[Recording]) -> None:
    assert hz(decays[1]) / hz(decays[0]) == pytest.approx(np.exp(0.2), rel=0.02)


def test_lumps_on_the_tail_lower_the_frequency(decays: list[Recording]) -> None:
    assert hz(decays[2]) / hz(decays[0]) < 0.95


def test_twice_the_damping_squares_the_decay(decays: list[Recording]) -> None:
    remaining = [np.abs(decay.hinges_rad[-70:, 0]).max() / decay.hinges_rad[0, 0] for decay in (decays[0], decays[3])]
    assert remaining[1] == pytest.approx(remaining[0] ** 2, rel=0.1)
    assert remaining[0] < 0.8


def test_water_is_carried_in_water_alone(decays: list[Recording]) -> None:
    assert (decays[4].marker_m == decays[0].marker_m).all()
    kg = prepared((EntrainedWater(0.01, 0.5),)).link_mass_kg - prepared().link_mass_kg
    tail = LAYOUT.strips.link > 0
    area_m2 = (2 * LAYOUT.strips.half_height_m * LAYOUT.strips.length_m)[tail].sum()
    assert kg[0, 0] == 0
    assert kg.sum() == pytest.approx(1000 * 2 * 0.01 * area_m2, rel=0.25)  # deeper where the fin is high


def test_a_bent_rest_is_where_the_tail_comes_to_rest(decays: list[Recording]) -> None:
    around = decays[5].hinges_rad[48:].mean(axis=0)
    gaps = np.array([segment.gap_m for segment in LAYOUT.robot.tail.segment])
    assert around == pytest.approx(0.03 * gaps / gaps.mean(), abs=0.006)


def test_a_gradient_keeps_the_mean_stiffness() -> None:
    factor = prepared((StiffnessGradient(0.5, 1.3),)).hinge_stiffness_n_m[0] / STIFFNESS
    assert factor.mean() == pytest.approx(1)
    assert factor[-1] / factor[0] == pytest.approx(np.exp(1.0))


def test_hardening_is_cubic_at_first_and_straight_in_the_end() -> None:
    hardening = StiffnessHardening(0.24, 0.2)
    torque = [hinge_torque(added(hardening, bent_by(q * HINGES))) / STIFFNESS for q in (0.01, 100.0, 101.0)]
    gap = 0.01 * 2 * HINGES
    assert torque[0] == pytest.approx(-0.24 / (3 * 0.2**2) * gap**2 * 0.01 * HINGES, rel=1e-3)
    assert torque[2] - torque[1] == pytest.approx(-0.24 * HINGES, rel=0.02)


def test_a_thinning_damper_resists_in_proportion_when_slow_and_levels_off_when_fast() -> None:
    slow, fast = (hinge_torque(added(JointDamping(0.5, 3.0), velocity=bent_by(w * HINGES))) for w in (1e-4, 1e5))
    assert slow == pytest.approx(-0.5 * DAMPING * 1e-4 * HINGES, rel=1e-3)
    assert fast == pytest.approx(-0.5 * DAMPING * 3.0 / 2, rel=2e-3)


def test_bristles_are_a_spring_before_they_slip_and_then_hold_the_sliding_torque() -> None:
    friction = JointFriction(0.03, 0.4, 0.05)
    at, roots = instant((friction,), velocity=bent_by(np.ones(LAYOUT.hinges)))
    together = of_one(JointFriction, 0.03, 0.4, 0.05)
    pushed = together.force(at.now, roots - 0.001)[0]
    assert hinge_torque(pushed) == pytest.approx(-0.03 / 0.005 * 0.001)
    for _ in range(200):  # the hinges stay and the roots go back instead
        roots = together.advance(at.now, roots, 1e-3) - 1e-3
    assert hinge_torque(together.force(at.now, roots - 0.5e-3)[0]) == pytest.approx(-0.03, rel=1e-3)


def test_friction_at_rest_holds_more_than_when_sliding() -> None:
    together = of_one(JointFriction, 0.03, 0.4, 0.05)
    at, roots = instant((JointFriction(0.03, 0.4, 0.05),), velocity=bent_by(np.full(LAYOUT.hinges, 1e-3)))
    for _ in range(200):
        roots = together.advance(at.now, roots, 0.5) - 0.5e-3
    assert hinge_torque(together.force(at.now, roots - 0.25e-3)[0]) == pytest.approx(-0.03 * 1.4, rel=1e-3)


def test_lumps_keep_the_total_mass_and_are_at_the_guides() -> None:
    plain, lumped = prepared(), prepared((MassDistribution(0.01, (0.0, 0.0, 0.0, 0.0, 1.0)),))
    assert lumped.link_mass_kg.sum() == pytest.approx(plain.link_mass_kg.sum(), rel=1e-12)
    extra, link = lumped.link_mass_kg - plain.link_mass_kg, LAYOUT.guide_link[-1]
    kg, arm = 0.01 * plain.link_mass_kg[0, 0], LAYOUT.guide_place_m[-1]
    assert extra[0, link] == pytest.approx(kg)
    inertia = lumped.link_inertia_kg_m2 - plain.link_inertia_kg_m2
    assert inertia[0, link] == pytest.approx(kg * arm**2, abs=1e-12)
