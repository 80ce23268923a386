from dataclasses import replace

import numpy as np
import pytest

from benchmarks.reality import Mechanism, Trial, World, simulate
from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanisms import EVERY, FAMILIES
from benchmarks.reality.mechanisms.tendons import (
    CrankArmError,
    TendonAsymmetry,
    TendonCompliance,
    TendonFriction,
    TendonSlack,
)
from swimcal.robot import load_robot
from tests.benchmarks.reality.motions import COEFFICIENTS
from tests.cases import later

ROBOT = load_robot()
STIFFNESS = ROBOT.tendons.stiffness_n_m
TENDONS = tuple(FAMILIES["tendons"])
SEEN: list[Instant] = []


class Look(Mechanism):
    """Keeps every instant."""

    def advance(self, now, state, step_s):  # noqa: ARG002
        SEEN.append(now)
        return state


def instants(*mechanisms, phase_rad=0.5, kind="dry"):
    """Of a crank that hardly turns."""
    SEEN.clear()
    trial = Trial(kind, 0.01, 1e-3 * (kind == "dry"), phase_rad=phase_rad, run_in_s=0.0, bent_rad=(0.1,) * 5)
    simulate([(World(COEFFICIENTS, mechanisms=(*mechanisms, Look())), trial)])
    return list(SEEN)


def grown(mechanism):
    """The mechanism with an array for each number, as it is in a running simulation."""
    return replace(mechanism, **{name: np.array([[value]]) for name, value in vars(mechanism).items()})


@pytest.mark.parametrize("name", [*TENDONS[:2], *later(*TENDONS[2:])])
def test_a_tail_without_tendons_does_not_feel_them(name):
    decay = Trial("free_decay", 0.3, bent_rad=(0.2,) * 5, release_s=0.05)
    mechanisms = EVERY[name](np.random.default_rng(2))(3.0)
    base, on = simulate([(World(COEFFICIENTS, mechanisms=m), decay) for m in ((), mechanisms)])
    assert np.abs(on.position_px - base.position_px).max() < 1e-9


def test_a_shorter_arm_pulls_the_tendon_less_in_proportion():
    upright, shorter = (instants(*m, phase_rad=0.0)[0].pull for m in [(), (CrankArmError(-0.1, -0.4),)])
    assert shorter.per_turn_m == pytest.approx(upright.per_turn_m * np.array([0.9, 0.6]), rel=0.025)


def test_compliances_in_series_add_up():
    mechanism = TendonCompliance(1.0, 3.0, 0.1)
    now = instants(mechanism)[0]
    assert now.parameters.tendon_stiffness_n_m == pytest.approx(STIFFNESS / np.array([[2.0, 4.0]]))
    stretch = now.pull.stretch_m
    tension = now.pull.tension_n - now.parameters.tendon_damping_n_s_m * now.pull.rate_m_s
    assert tension == pytest.approx(STIFFNESS / np.array([[2.0, 4.0]]) * stretch)


def test_the_knots_lose_the_same_work_at_any_speed():
    """A Dahl loop of half width X: 4 z0 F (X / z0 - tanh(X / z0)), F what the bristles hold at most, z0 their give."""
    mechanism, now = grown(TendonCompliance(2.0, 2.0, 0.2)), instants(TendonCompliance(2.0, 2.0, 0.2))[0]
    half, give = 0.003, 0.001
    hold = 0.2 * STIFFNESS / 3 * give
    works = []
    for period_s in (0.5, 2.0):
        state, work = np.zeros((1, 2)), 0.0
        for k in range(2000):
            rate = half * 2 * np.pi / period_s * np.cos(2 * np.pi * (k + 0.5) / 1000)
            moving = replace(now, pull=replace(now.pull, rate_m_s=np.full((1, 2), rate)))
            later = mechanism.advance(moving, state, period_s / 1000)
            work += (k >= 1000) * hold * (state + later)[0, 0] / 2 / give * rate * period_s / 1000
            state = later
        works.append(work)
    assert works[0] == pytest.approx(works[1])
    assert works[0] == pytest.approx(4 * give * hold * (half / give - np.tanh(half / give)), rel=1e-3)


def test_a_slack_line_neither_pulls_nor_pushes_in_its_play():
    mechanism, now = grown(TendonSlack(0.002, 0.003, 0.004)), instants()[0]

    def tension(left, right):
        pull = replace(now.pull, stretch_m=np.array([[left, right]]), rate_m_s=np.zeros((1, 2)))
        pull = replace(pull, tension_n=now.parameters.tendon_stiffness_n_m * pull.stretch_m)
        force = mechanism.force(replace(now, pull=pull), np.zeros((1, 0))) + now.tighten(pull.tension_n)
        return np.linalg.lstsq(-now.pull.gradient_m[0].T, force[0], rcond=None)[0]

    assert np.abs(tension(-0.001, -0.0005)).max() < 0.02 * STIFFNESS * 0.002
    assert tension(0.006, 0.006) == pytest.approx(STIFFNESS * np.array([0.004, 0.003]), rel=0.01)
    assert tension(-0.008, -0.008) == pytest.approx(-STIFFNESS * np.array([0.004, 0.004]), rel=0.01)


@pytest.mark.long
def test_slack_narrows_the_bend_of_the_tail():
    dry = Trial("dry", 1.0, 1.0, run_in_s=0.2)
    tight, loose = simulate(
        [(World(COEFFICIENTS, mechanisms=m), dry) for m in ((), (TendonSlack(0.005, 0.005, 0.005),))]
    )
    assert np.ptp(loose.hinges_rad[:, 1]) < 0.9 * np.ptp(tight.hinges_rad[:, 1])


def test_friction_in_the_guides_resists_each_hinge_by_the_guides_before_it():
    """The last hinge slides both lines through four guides; they hold hinge h by (its guides) x level x arm."""
    mechanism, now = TendonFriction(2.0, 0.0), instants(phase_rad=0.0)[0]
    rate = np.zeros_like(now.pose.rate_rad_s)
    rate[:, -1] = 5.0
    turning = replace(now, pose=replace(now.pose, rate_rad_s=rate))
    state = mechanism.start(now)
    for _ in range(2000):
        state = mechanism.advance(turning, state, 0.001)
    layout = now.layout
    guide_x, guide_y = layout.origin_m[layout.guide_link] + layout.guide_place_m, layout.guide_offset_m[0]  # left line
    gap = layout.gap_of_hinge
    slope = np.append(0.0, np.diff(guide_y) / np.diff(guide_x))[gap]
    arms = (guide_y[gap] + slope * (layout.origin_m[1:] - guide_x[gap])) / np.hypot(1, slope)
    torque = -2 * 2.0 * np.sign(arms[-1]) * arms * gap  # the crank's own gap has no guide before it
    assert mechanism.force(now, state) == pytest.approx(now.bend(torque[None]), rel=1e-3, abs=1e-6)


def test_unequal_tendons_bend_the_tail_to_the_shorter_side():
    left, right = (instants(TendonAsymmetry(-s * 0.001, s * 0.001), phase_rad=0.0)[0] for s in (1.0, -1.0))
    straight = instants(phase_rad=0.0)[0]
    assert np.abs(straight.pose.hinge_rad).max() < 1e-3
    assert left.pose.hinge_rad == pytest.approx(-right.pose.hinge_rad, abs=1e-3)
    pulled_left = instants(phase_rad=0.3)[0].pose.hinge_rad
    assert np.sign(left.pose.hinge_rad[0, 0]) == np.sign(pulled_left[0, 0])


def test_an_asymmetry_is_a_shift_of_the_crank():
    """Both lines are as long as the crank at asin(length / radius) would make them."""
    shift = np.arcsin(0.001 / ROBOT.crank.anchor_radius_m)
    short, shifted = instants(TendonAsymmetry(-0.001, 0.001), phase_rad=0.0)[0], instants(phase_rad=shift)[0]
    assert short.pose.hinge_rad == pytest.approx(
        shifted.pose.hinge_rad, abs=0.05 * np.abs(shifted.pose.hinge_rad).max()
    )
