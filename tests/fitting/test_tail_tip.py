"""Which derivative of the tail's tip is nearer the truth on boxes that lie on half pixels, and where that ends; and
the tip in the frame that swims along, against a wave in closed form and however the pool lies.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting.tail_tip import TailSwim, published_motion, smoothed_motion, tip_motion
from swimmer.large_amplitude import mean_thrust_large
from tests.fitting.tails import PIXEL_M, on_half_pixels
from tests.fitting.test_ebt import swim
from tests.swimmer.test_large_amplitude import MASS, thrust_of_wave


def bias(hz: float, amplitude: float, seeds: int = 8, jitter_px: float = 0.3) -> tuple[float, float]:
    """Relative bias of <h_t^2> by finite differences and by smoothing, over boxes that jitter on a half-pixel grid."""
    true = (2 * np.pi * hz * amplitude) ** 2 / 2
    clean = swim(hz, amplitude)
    found = []
    for seed in range(seeds):
        boxes = seen(clean, jitter_px, np.random.default_rng(seed))
        found.append([float(motion(boxes).lateral_speed_sq) for motion in (published_motion, smoothed_motion)])
    published, smoothed = np.mean(found, axis=0) / true - 1
    return float(published), float(smoothed)


def seen(clean: TailSwim, jitter_px: float, random: np.random.Generator) -> TailSwim:
    jitter = jitter_px * PIXEL_M * random.normal(size=clean.tip_m.shape)
    return replace(clean, tip_m=on_half_pixels(clean.tip_m + jitter))


@pytest.mark.parametrize(("hz", "amplitude"), [(0.3, 0.03), (0.4, 0.015), (0.4, 0.06), (0.5, 0.04)])
def test_at_slow_beats_smoothing_takes_away_most_of_the_bias(hz: float, amplitude: float) -> None:
    published, smoothed = bias(hz, amplitude)

    assert published > 0.04
    assert abs(smoothed) < 0.25 * published


def test_at_fast_beats_smoothing_takes_some_of_the_beat_itself() -> None:
    """So that a fit over all speeds bends: the price, known and stated."""
    published, smoothed = bias(1.3, 0.06)

    assert abs(published) < 0.01
    assert smoothed == pytest.approx(-0.107, abs=0.01)


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
    motion, whole = tip_motion(wave_swim()), slice(10, -10)  # the filter's window ends at the first and last frame
    beat = WAVE["angular"] * np.arange(3000) / 600
    middle, tip = (np.sin(WAVE["wave_number"] * along - beat) for along in (0.450, 0.451))
    angle, lateral = -np.arctan(WAVE["amplitude"] * WAVE["wave_number"] * middle), WAVE["angular"] * tip

    np.testing.assert_allclose(motion.angle_rad[whole], angle[whole], atol=1e-3)
    np.testing.assert_allclose(motion.lateral_speed[whole], -WAVE["amplitude"] * lateral[whole], atol=1e-3)
    np.testing.assert_allclose(motion.forward_speed, 0.0, atol=1e-9)


def test_the_thrust_of_a_tracked_wave_is_the_closed_form() -> None:
    motion = tip_motion(wave_swim())
    expected = thrust_of_wave(**WAVE, speed=SPEED)
    other_way = mean_thrust_large(motion._replace(angle_rad=-motion.angle_rad), SPEED, MASS)

    assert mean_thrust_large(motion, SPEED, MASS) == pytest.approx(expected, rel=2e-3)
    assert abs(other_way / expected - 1) > 0.02


@pytest.mark.parametrize("angle", [0.7, np.pi, -2.4])
def test_however_the_pool_lies_the_tip_moves_the_same(angle: float) -> None:
    still = wave_swim(yawing=0.1, turning=0.02)
    turned = replace(
        still, pool_m=still.pool_m @ rotation(np.array(-angle)) + 0.3, heading_rad=still.heading_rad + angle
    )

    for part, same in zip(tip_motion(turned), tip_motion(still), strict=True):
        np.testing.assert_allclose(part, same, rtol=0, atol=1e-11)


def test_a_head_that_yaws_in_beat_does_not_turn_the_frame() -> None:
    for part, same in zip(tip_motion(wave_swim(yawing=0.2)), tip_motion(wave_swim()), strict=True):
        np.testing.assert_allclose(part, same, atol=1e-3)
