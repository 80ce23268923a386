import numpy as np
import pytest

from benchmarks.reality import Trial, World, simulate
from benchmarks.reality.camera import Sight
from benchmarks.reality.mechanism import worn
from benchmarks.reality.mechanisms import EVERY
from benchmarks.reality.mechanisms.outside import (
    CamberedFin,
    CrackedSegment,
    CreepingTendon,
    LooseningMarker,
    Propwash,
    SlippingCoupling,
    Tether,
    TimingGlitch,
    TrappedBubble,
    VortexBuffeting,
    WaterInHull,
)
from benchmarks.reality.motion import Motion
from benchmarks.reality.tendons import Turn
from tests.benchmarks.reality.mechanisms.one_fish import (
    LAYOUT,
    STILL,
    STRAIGHT,
    added,
    ahead,
    bent_by,
    hinge_torque,
    instant,
    of_one,
    prepared,
)
from tests.benchmarks.reality.motions import COEFFICIENTS

HINGES = np.linspace(0.02, 0.1, LAYOUT.hinges)
FRAMES_S = np.arange(301) / 60


def test_a_loose_marker_slides_out_and_lags_behind_the_sweep() -> None:
    sweep = 1j * 0.02 * np.sin(2 * np.pi * FRAMES_S)
    at = np.stack([sweep, sweep, sweep + 0.4, sweep + 0.5], axis=1)
    sight = Sight(("nose", "neck", "tail_1", "tail_2"), FRAMES_S, at, np.ones(at.shape, complex), np.zeros(at.shape))
    off = LooseningMarker(0.6, 0.004, 3.0, 0.003).place(sight).marker_m - at
    assert np.abs(off[:, :3]).max() == 0
    assert off[:, 3].real == pytest.approx(0.004 * (1 - np.exp(-FRAMES_S / 3)), abs=1e-12)
    assert np.corrcoef(off[:, 3].imag, np.cos(2 * np.pi * FRAMES_S))[0, 1] < -0.95
    assert np.abs(off[:, 3].imag).max() < 0.003


def test_wear_goes_on_from_trial_to_trial() -> None:
    cracked, fin = CrackedSegment(1.0, 0.2, 2.0, 0.2), CamberedFin(0.1)
    later, same = worn((cracked, fin), 100.0)
    assert same is fin
    assert np.abs(added(cracked, bent_by(HINGES))).max() < 1e-4
    assert np.abs(added(later, bent_by(HINGES))).max() > 1e-3


def test_a_crack_takes_its_share_of_one_gaps_spring() -> None:
    torque = hinge_torque(added(CrackedSegment(1.0, 0.2, 2.0, 0.2), bent_by(HINGES), time_s=20.0))
    spring = prepared().hinge_stiffness_n_m[0] * HINGES
    assert torque == pytest.approx(np.where(LAYOUT.gap_of_hinge == 1, 0.2 * spring, 0.0), abs=1e-9)


def test_a_cambered_fin_lifts_at_no_angle_of_attack_and_does_no_work() -> None:
    fin = LAYOUT.robot.caudal_fin
    straight = added(CamberedFin(0.1), velocity=ahead(0.3))
    assert straight[1] == pytest.approx(0.5 * 1000 * fin.span_m * fin.chord_m * 0.1 * 0.3**2)
    moving = ahead(0.3) + bent_by(HINGES)
    assert added(CamberedFin(0.1), bent_by(HINGES), moving) @ moving == pytest.approx(0, abs=1e-12)


def test_a_tether_pulls_towards_its_post_and_harder_from_further_off() -> None:
    near, far = (added(Tether(x, 0.0, 3.0, 0.04, 0.0)) for x in (1.5, 2.8))
    sag = np.sqrt(3 * 1.5 * 1.5 / 8 + (0.05 * 1.5) ** 2)
    assert near[0] == pytest.approx(0.04 * 1.5**2 / (8 * sag))
    assert near[1] == 0
    assert far[0] > 3 * near[0]


def test_glitches_repeat_and_skip_whole_frames_and_more_of_them_at_more_strength() -> None:
    few, many = (TimingGlitch(rate, 3).expose(FRAMES_S) for rate in (1.0, 5.0))
    steps = np.diff(many) * 60
    assert steps == pytest.approx(np.round(steps), abs=1e-9)
    assert steps.min() == pytest.approx(0, abs=1e-9)
    assert steps.max() > 1.5
    off = [np.abs(np.diff(shown) - 1 / 60) > 1e-6 for shown in (few, many)]
    assert (off[1] | ~off[0]).all()
    assert off[1].sum() > off[0].sum() > 0
    assert many[0] == 0


def test_a_coupling_slips_at_the_rate_of_the_torque_beyond() -> None:
    at, state = instant((SlippingCoupling(0.1, 0.05),), crank_rad=0.3)
    slipping = of_one(SlippingCoupling, 0.1, 0.05)
    torque = float(at.now.pull.crank_torque_n_m[0, 0])
    assert abs(torque) > 0.5
    for _ in range(400):
        state = slipping.advance(at.now, state, 1e-3)
    slip = 0.05 * np.sign(torque) * (abs(torque) - 0.1)
    turn = slipping.turn(np.full((1, 1), 0.4), Turn(np.ones((1, 1)), np.ones((1, 1))), state)
    assert turn.speed_rad_s[0, 0] == pytest.approx(1 - slip)
    assert state[0, 1] == pytest.approx(slip * (0.4 - 0.02), rel=0.02)


def test_a_tendon_that_crept_is_a_longer_tendon() -> None:
    plain = prepared()
    longer = plain.tendon_extra_m + np.array([[0.0005, 0.0]])
    motions = [
        Motion(LAYOUT, type(plain)(**{**vars(plain), "tendon_extra_m": extra}), np.zeros(1), np.zeros(1), [()])
        for extra in (plain.tendon_extra_m, longer)
    ]
    there = np.zeros((1, 1)), bent_by(HINGES)[None], STILL[None]
    base, long = (motion.equations(*there, [], 1e-3).force[0] for motion in motions)
    crept = added(CreepingTendon(4.0, 0.001, 0.0), bent_by(HINGES), time_s=4.0)
    assert crept == pytest.approx(long - base, abs=1e-9)


def test_buffeting_has_its_lift_and_its_strouhal_frequency() -> None:
    robot, speed, width = LAYOUT.robot, 0.3, 0.05
    at, state = instant((VortexBuffeting(0.5, width, 0.4),), velocity=ahead(speed))
    shed = of_one(VortexBuffeting, 0.5, width, 0.4)
    assert shed.advance(at.now, state, 0.01) - state == pytest.approx(0.01 * speed / width, rel=0.01)
    travelled = np.arange(4000) * 0.25
    force = np.array([shed.force(at.now, state + way)[0, 1] for way in travelled])
    size = 0.5 * 0.5 * 1000 * robot.caudal_fin.chord_m * robot.caudal_fin.span_m * speed**2
    assert force.std() == pytest.approx(size, rel=0.05)
    spectrum = np.abs(np.fft.rfft(force)) ** 2
    mean = (np.fft.rfftfreq(len(force), 0.25) * spectrum).sum() / spectrum.sum()
    assert mean == pytest.approx(0.2, rel=0.05)


def test_water_in_a_hull_at_rest_sloshes_at_its_frequency_and_pushes_the_hull() -> None:
    at, state = instant((WaterInHull(0.05, 1.2, 0.0, 0.1),))
    water = of_one(WaterInHull, 0.05, 1.2, 0.0, 0.1)
    assert np.abs(water.force(at.now, state)).max() == 0
    state = state + np.array([[0.01j, 0.0]])
    push = water.force(at.now, state)[0]
    assert push[1] == pytest.approx(0.05 * (2 * np.pi * 1.2) ** 2 * 0.01)
    assert push[2] == pytest.approx(0.1 * push[1])
    place = []
    for _ in range(2500):
        state = water.advance(at.now, state, 1e-3)
        place.append(state[0, 0].imag)
    zeros = np.flatnonzero(np.diff(np.sign(place)))
    assert 1e3 / (2 * np.diff(zeros).mean()) == pytest.approx(1.2, rel=0.01)


def test_a_jet_exerts_nothing_on_a_fish_that_drifts_along_and_nothing_far_off() -> None:
    along = np.concatenate([[0.0, 0.05], STILL[2:]])
    drifts = instant((Propwash(0.05, np.pi / 2, 0.0, 1e3),), velocity=along)[0].force
    assert drifts == pytest.approx(instant(())[0].force, abs=1e-9)
    assert np.abs(added(Propwash(0.05, np.pi / 2, 9.0, 0.3))).max() < 1e-9
    assert added(Propwash(0.05, np.pi / 2, 0.0, 1e3))[1] > 0.01


def test_a_bubble_drags_while_it_is_there() -> None:
    bubble = TrappedBubble(0.25, 2.0, 0.5, 0.0, 0.1)
    there, gone = (added(bubble, STRAIGHT, ahead(0.3), time_s) for time_s in (0.0, 1.0))
    assert there[0] == pytest.approx(0.25 * 0.3**2, rel=0.02)
    assert abs(gone[0]) < 1e-3 * there[0]


@pytest.mark.long
def test_a_batch_of_all_sorts_is_each_alone() -> None:
    swim = Trial("swim", 0.05, 1.0, phase_rad=0.9, run_in_s=0.05)
    names = ("vortex_buffeting", "water_in_hull", "propwash", "fluid_memory", "wall_proximity", "joint_friction")
    drawn = [EVERY[name](np.random.default_rng(4)) for name in names]
    jobs = [(World(COEFFICIENTS, mechanisms=at(strength)), swim) for at in drawn for strength in (2.0, 5.0)]
    for each, job in list(zip(simulate(jobs), jobs, strict=True))[::2]:
        assert each.position_px == pytest.approx(simulate([job])[0].position_px, abs=1e-8)
