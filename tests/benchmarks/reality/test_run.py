from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from benchmarks.reality import Nuisances, Trial, World, simulate
from benchmarks.reality.layout import lay_out
from benchmarks.reality.mechanisms.fluid import BackgroundCurrent
from benchmarks.reality.mechanisms.structure import JointFriction
from benchmarks.reality.parameters import Parameters, nominal_parameters
from benchmarks.reality.run import balanced_hinges
from benchmarks.reality.tendons import Turn
from benchmarks.reality.world import prepared_parameters
from swimcal.errors import SimulationDiverged
from swimcal.mjcf import DRY
from swimcal.robot import load_robot
from swimcal.runs import Runs
from swimcal.twin import Twin
from tests.benchmarks.reality.motions import COEFFICIENTS

BASE = World(COEFFICIENTS)
SWIM = Trial("swim", 0.6, 1.0, phase_rad=0.4, run_in_s=0.2)


@pytest.mark.long
def test_the_crank_is_recorded_for_as_long_as_the_trial_whatever_else_is_simulated():
    short, longer = (BASE, SWIM), (BASE, replace(SWIM, duration_s=1.1))
    (alone,), (joint, other) = simulate([short]), simulate([short, longer])
    assert np.array_equal(joint.drive.time_s, alone.drive.time_s)
    assert joint.drive.angle_rad == pytest.approx(alone.drive.angle_rad, abs=1e-9)
    assert joint.drive.torque_n_m == pytest.approx(alone.drive.torque_n_m, abs=1e-6)
    for one in (alone, other):
        assert 0.0 <= one.drive.time_s[-1] - one.trial.duration_s <= 0.004


@pytest.mark.long
def test_recordings_do_not_depend_on_their_company():
    trials = [
        (BASE, SWIM),
        (replace(BASE, mechanisms=(JointFriction(0.05, 0.1, 0.05),)), replace(SWIM, frequency_hz=0.7)),
        (replace(BASE, nuisances=Nuisances(head_mass=1.1)), Trial("dry", 0.4, 0.8)),
        (BASE, Trial("free_decay", 0.3, bent_rad=(0.1, 0.1, 0.1, 0.0, 0.0))),
        (replace(BASE, mechanisms=(JointFriction(0.01, 0.1, 0.05),)), replace(SWIM, duration_s=0.5)),
    ]
    together, order = simulate(trials), [3, 0, 4, 2, 1]
    shuffled = simulate([trials[i] for i in order])
    for i, other in zip(order, shuffled, strict=True):
        assert other.trial == trials[i][1]
        assert np.abs(other.position_px - together[i].position_px).max() < 1e-7
    (alone,) = simulate(trials[:1])
    assert np.abs(alone.position_px - together[0].position_px).max() < 1e-7


@pytest.mark.long
def test_the_step_converges_with_second_order():
    ends = [simulate([(BASE, SWIM)], step_s=h)[0].marker_m[-1] for h in (2e-3, 1e-3, 5e-4, 2.5e-4)]
    errors = [np.abs(a - b).max() for a, b in pairwise(ends)]
    assert errors[-1] < 1e-5
    assert errors[0] / errors[1] > 3.0
    assert errors[1] / errors[2] > 3.0


@pytest.mark.long
def test_more_hinges_converge():
    ends = [simulate([(BASE, SWIM)], hinges_per_gap=n)[0].marker_m[-1] for n in (1, 2, 4)]
    first, second = (np.abs(a - b).max() for a, b in pairwise(ends))
    assert first < 5e-3
    assert second < 0.4 * first  # errors fall with the square of their number


@pytest.mark.long
def test_one_hinge_a_gap_moves_in_air_as_the_twin_does():
    """Two programs, one mechanism: chain, springs, tendons and crank are those of the description."""
    time_s = np.arange(0, 0.8, 1 / 60)
    (dry,) = simulate([(BASE, Trial("dry", time_s[-1], 0.9, phase_rad=0.3))], hinges_per_gap=1)
    runs = Runs(np.array([COEFFICIENTS]), np.array([0.9]), np.array([0.3]))
    twin = Twin(load_robot(), scene=replace(DRY, timestep_s=5e-4), workers=1).simulate(runs, time_s)
    assert np.abs(dry.hinges_rad).max() > 0.3
    assert dry.hinges_rad[30:] == pytest.approx(twin.hinges_rad[0, 30:], abs=4e-3)
    crank_rad = np.interp(time_s, dry.drive.time_s, dry.drive.angle_rad)
    assert crank_rad == pytest.approx(twin.crank_rad[0], abs=2e-3)


def test_the_tail_starts_in_balance_with_its_tendons():
    slow = Trial("dry", 0.5, 0.02, phase_rad=1.2, run_in_s=0.0)
    (dry,) = simulate([(BASE, slow)])
    assert np.abs(dry.hinges_rad[0]).max() > 0.1
    assert np.abs(dry.hinges_rad[1] - dry.hinges_rad[0]).max() < 1e-3


def test_a_swim_starts_where_and_as_asked_and_goes_forward():
    trial = replace(SWIM, place_m=0.3 - 0.2j, heading_rad=0.5, start_speed_m_s=0.15, run_in_s=0.0, duration_s=1.0)
    (swim,) = simulate([(BASE, trial)])
    ahead = np.array([np.cos(0.5), np.sin(0.5)])
    assert swim.head[0] == pytest.approx([0.3, -0.2, 0.5 + np.pi])
    assert (swim.head[1, :2] - swim.head[0, :2]) @ ahead * 60 == pytest.approx(0.15, rel=0.1)
    assert (swim.head[-1, :2] - swim.head[0, :2]) @ ahead > 0.1
    nose, neck = (swim.markers.index(name) for name in ("nose", "neck"))
    assert (swim.marker_m[0, nose] - swim.marker_m[0, neck]) @ ahead == pytest.approx(0.142)


@pytest.mark.long
def test_a_current_carries_the_fish_along():
    def drifted(current):
        world = replace(BASE, mechanisms=(BackgroundCurrent(current, 0.0, 0.0),))
        at_rest = Trial("swim", 0.5, 1.0, run_in_s=0.0, start_speed_m_s=0.0)
        moving = replace(at_rest, start_speed_m_s=-0.1)  # seen from water that flows to +x, as the fish heads for -x
        return simulate([(world, moving if current else at_rest)])[0]

    still, carried = drifted(0.0), drifted(0.1)
    shift = np.stack([0.1 * still.time_s, 0 * still.time_s], axis=1)
    assert carried.head[:, :2] - still.head[:, :2] == pytest.approx(shift, abs=1e-9)  # Galilei


@pytest.mark.long
def test_what_blows_up_is_an_error():
    wild = replace(BASE, coefficients=(-40.0, -40.0, 0.0, 0.0, 0.0))
    with pytest.raises(SimulationDiverged, match="1 of 1 reference simulations diverged; the first a swim at 1 Hz"):
        simulate([(wild, SWIM)])
    brief = replace(SWIM, duration_s=0.3)
    lost, kept = simulate([(wild, SWIM), (BASE, brief)], allow_divergence=True)
    assert np.isnan(lost.position_px).all()
    assert np.isfinite(kept.position_px).all()


@pytest.mark.long
def test_nuisances_move_what_they_name():
    its = Nuisances(marker_shift_m={"neck": (0.004, -0.002)})
    heavy = Nuisances(head_mass=1.2, tail_mass=1.2, hinge_stiffness=1.2, hinge_damping=1.2)
    decay = Trial("free_decay", 0.3, bent_rad=(0.1, 0.1, 0.05, 0.0, 0.0), heading_rad=np.pi)
    base, shifted, alike = simulate(
        [(replace(BASE, nuisances=n), decay) for n in (Nuisances(), its, heavy)]  # inertia, springs, dampers alike
    )
    moved = shifted.marker_m - base.marker_m
    neck = base.markers.index("neck")
    assert moved[:, neck] == pytest.approx(np.tile([0.004, -0.002], (len(moved), 1)), abs=1e-9)
    assert np.abs(np.delete(moved, neck, axis=1)).max() < 1e-12
    assert alike.hinges_rad == pytest.approx(base.hinges_rad, abs=1e-9)
    sunk = prepared_parameters(replace(BASE, nuisances=Nuisances(sunk_m=0.003)), SWIM, lay_out(load_robot()), ("nose",))
    assert sunk.sunk_m == pytest.approx(np.full((1, 1), 0.003))
    soft = replace(BASE, nuisances=Nuisances(hinge_stiffness=0.8))
    assert np.abs(simulate([(soft, decay)])[0].hinges_rad - base.hinges_rad).max() > 5e-3


def test_a_tail_that_snaps_where_it_starts_is_not_thrown():
    """With a longer arm the pulled tail has two poses; where it changes between them its slope is without bound."""
    layout = lay_out(load_robot())
    one = nominal_parameters(layout, ("nose", "neck"), COEFFICIENTS)
    phase = np.linspace(1.3, 1.4, 100)[:, None]
    longer = Parameters.stacked([replace(one, anchor_radius_m=1.05 * one.anchor_radius_m)] * len(phase))
    speed = 2 * np.pi
    hinges, rates = balanced_hinges(layout, longer, Turn(phase, np.full_like(phase, speed)))
    assert np.abs(np.diff(hinges, axis=0)).max() > 0.1
    assert np.abs(rates).max() <= 5 * speed
