"""Elongated body theory fitted to speeds of its own making, and the motion of the tail and its tip in closed form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fitting.ebt import (
    FORMS,
    EbtForm,
    TailSwim,
    fit_ebt,
    measured_tail,
    noise_flags,
    pool_motion,
    published_motion,
    tip_motion,
)
from swimcal.ebt import TailMotion
from swimcal.robot import load_robot
from tests.fitting.swims import by_hand, straight_swim
from tests.fitting.tails import PIXEL_M, on_half_pixels
from tests.fitting.test_trial_checks import measured
from tests.fitting.test_trial_checks import swim as beating

Motion = Callable[[TailSwim], TailMotion]
ROBOT = load_robot()
AMPLITUDE, SLOPE = 0.06, 0.4
QUIETED = 0.065
"""Share of <h_t^2> that smoothing over 11 frames takes from a beat of 1 Hz at 60 frames a second."""
each_motion = pytest.mark.parametrize(
    ("motion", "kept"), [(published_motion, 1.0), (pool_motion, 1 - QUIETED)], ids=["published", "smoothed"]
)
each_form = pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)


def swim(hz: float = 1.0, amplitude: float = AMPLITUDE, slope: float = SLOPE, speed: float = 0.1) -> TailSwim:
    """A fish that swims towards -x without turning: the last marker sways, the line through the last two tilts."""
    time_s = np.arange(301) / 60
    lateral = amplitude * np.cos(2 * np.pi * hz * time_s)
    tilt = slope * np.sin(2 * np.pi * hz * time_s)
    before = np.column_stack([np.full_like(time_s, 0.40), lateral - 0.05 * tilt])
    tip = np.stack([before, np.column_stack([np.full_like(time_s, 0.45), lateral])], axis=1)  # (n, 2, 2)
    path = np.column_stack([-speed * time_s, np.zeros_like(time_s)])[:, None]
    used = time_s < np.floor(time_s[-1] * hz) / hz - 1e-9
    return TailSwim(time_s, tip, tip + path, np.zeros_like(time_s), np.ones((len(time_s), 2)), used, hz)


SWIMS = [swim(0.5, 0.04, 0.5, 0.05), swim(0.8), swim(1.4, 0.07, 0.35, 0.2)]


def speeds(form: EbtForm, ratio: float) -> np.ndarray:
    return np.array([float(form.speed(form.motion(one), ROBOT, 1.0, ratio)) for one in SWIMS])


@each_form
@pytest.mark.parametrize("ratio", [0.05, 0.31 / 0.91, 1.63, 8.0])
def test_each_form_recovers_the_ratio_that_made_the_speeds(form: EbtForm, ratio: float) -> None:
    found = fit_ebt(form, SWIMS, speeds(form, ratio), ROBOT)

    assert found.drag_coefficient / found.beta == pytest.approx(ratio, rel=2e-3)
    assert [found.speed(one, ROBOT) for one in SWIMS] == pytest.approx(speeds(form, ratio), rel=1e-3)


@pytest.mark.parametrize(("noise_px", "told"), [(0.5, False), (6.0, True)])
def test_a_tail_speed_of_elongated_body_theory_that_is_mostly_noise_is_flagged(noise_px: float, told: bool) -> None:
    assert bool(noise_flags(measured(*beating(noise_px=noise_px)))) == told


@each_form
def test_it_says_that_only_the_ratio_is_identifiable(form: EbtForm) -> None:
    flags = fit_ebt(form, SWIMS, speeds(form, 1.0), ROBOT).flags

    assert [flag.kind for flag in flags] == ["ebt_ratio_only"]
    assert "c_D / beta = 1" in flags[0].message


@pytest.mark.parametrize(("factor", "value"), [(100.0, 0.0), (1e-3, 10.0 / 0.9)], ids=["no_drag", "all_drag"])
def test_a_ratio_at_its_bound_is_flagged(factor: float, value: float) -> None:
    found = fit_ebt(FORMS[0], SWIMS, factor * speeds(FORMS[0], 1.0), ROBOT)

    assert found.drag_coefficient / found.beta == pytest.approx(value, abs=2e-3)
    assert "at_bound" in [flag.kind for flag in found.flags]
    assert 0.9 <= found.beta <= 1.1
    assert 0.0 <= found.drag_coefficient <= 10.0


@each_motion
def test_the_motion_of_a_wave_is_that_of_its_formula(motion: Motion, kept: float) -> None:
    found = motion(swim())

    assert found.lateral_speed_sq == pytest.approx(kept * (2 * np.pi * AMPLITUDE) ** 2 / 2, rel=0.01)
    assert found.slope_sq == pytest.approx(SLOPE**2 / 2, rel=0.02)


def test_the_two_rearmost_markers_count_however_the_fish_lies() -> None:
    still = swim()
    position = straight_swim(len(still.time_s), fps=60.0)
    position[:, 3:] += still.tip_m - still.tip_m.mean(axis=0)
    cos, sin = np.cos(2.0), np.sin(2.0)
    trial = by_hand(position @ np.array([[cos, sin], [-sin, cos]]), fps=60.0)

    motion = published_motion(measured_tail(trial, trial.kept))
    assert motion.lateral_speed_sq == pytest.approx((2 * np.pi * AMPLITUDE) ** 2 / 2, rel=5e-3)
    assert motion.slope_sq == pytest.approx(SLOPE**2 / 2, rel=5e-3)


def bias(hz: float, amplitude: float, seeds: int = 8, jitter_px: float = 0.3) -> tuple[float, float]:
    """Relative bias of <h_t^2> by finite differences and by smoothing, over boxes that jitter on a half-pixel grid."""
    true = (2 * np.pi * hz * amplitude) ** 2 / 2
    clean = swim(hz, amplitude)
    found = []
    for seed in range(seeds):
        boxes = seen(clean, jitter_px, np.random.default_rng(seed))
        found.append([float(motion(boxes).lateral_speed_sq) for motion in (published_motion, pool_motion)])
    published, smoothed = np.mean(found, axis=0) / true - 1
    return float(published), float(smoothed)


def seen(clean: TailSwim, jitter_px: float, random: np.random.Generator) -> TailSwim:
    jitter = jitter_px * PIXEL_M * random.normal(size=clean.tip_m.shape)
    in_pool = on_half_pixels(clean.pool_m + jitter)
    return replace(clean, tip_m=on_half_pixels(clean.tip_m + jitter), pool_m=in_pool)


@pytest.mark.parametrize(("hz", "amplitude"), [(0.3, 0.03), (0.4, 0.015), (0.4, 0.06), (0.5, 0.04)])
def test_at_slow_beats_smoothing_takes_away_most_of_the_bias(hz: float, amplitude: float) -> None:
    published, smoothed = bias(hz, amplitude)

    assert published > 0.04
    assert abs(smoothed) < 0.25 * published


WAVE = {"amplitude": 0.06, "wave_number": 8.0, "angular": 2 * np.pi}
SPEED = 0.1


def wave_swim(yawing: float = 0.0, turning: float = 0.0) -> TailSwim:
    """A fish that swims towards -x, its tail tip on the wave h = A cos(k x - w t), seen often enough for derivatives.

    Args:
        yawing: of the head in beat, rad; the tail does not follow.
        turning: of the whole fish, rad/s.
    """
    time_s = np.arange(3001) / 600
    along = np.array([0.449, 0.451])
    phase = WAVE["wave_number"] * along - WAVE["angular"] * time_s[:, None]
    tail = np.stack([np.broadcast_to(along, phase.shape), WAVE["amplitude"] * np.cos(phase)], axis=2)  # (n, 2, 2)
    path = np.column_stack([-SPEED * time_s, np.zeros_like(time_s)])[:, None]
    course = turning * time_s
    pool = np.einsum("nij,nkj->nki", rotation(course), tail + path)
    heading = course + yawing * np.sin(WAVE["angular"] * time_s)
    shape = np.einsum("nij,nkj->nki", rotation(-yawing * np.sin(WAVE["angular"] * time_s)), tail)
    return TailSwim(time_s, shape, pool, heading, np.ones((len(time_s), 2)), time_s < 5.0 - 1e-9, 1.0)


def rotation(angle: np.ndarray) -> np.ndarray:
    """(..., 2, 2) counter-clockwise."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([cos, -sin], axis=-1), np.stack([sin, cos], axis=-1)], axis=-2)


def test_the_tip_of_a_wave_moves_and_leans_as_its_formula_says() -> None:
    """The tip leans the way it moves: both are a sine of the beat, seen from a fish whose left is -y."""
    motion, whole = tip_motion(wave_swim()), slice(60, -60)  # the filter's window ends at the first and last frame
    beat = WAVE["angular"] * np.arange(3000) / 600
    middle, tip = (np.sin(WAVE["wave_number"] * along - beat) for along in (0.450, 0.451))
    angle, lateral = -np.arctan(WAVE["amplitude"] * WAVE["wave_number"] * middle), WAVE["angular"] * tip

    np.testing.assert_allclose(motion.angle_rad[whole], angle[whole], atol=1e-3)
    expected = -WAVE["amplitude"] * lateral[whole]
    # a parabola over a sixth of a second flattens the fastest part of this beat by 3.5 %
    np.testing.assert_allclose(motion.lateral_speed[whole], expected, atol=0.04 * np.abs(expected).max())
    np.testing.assert_allclose(motion.forward_speed, 0.0, atol=1e-9)
