"""What the twin itself swam is found again, wherever the pool lies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fitting.coefficient_fit import fit_coefficients
from fitting.measure_trial import measure_trial
from fitting.picture_scale import at_scale
from fitting.published import Swims
from fitting.trial import MeasuredTrial
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.session import TrialSpec
from swimcal.session_file import CameraSpec
from swimcal.tracks import as_tracks
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS
from tests.cases import later
from tests.fitting.exact_swims import ROBOT, exact_swims, exact_twin

TRUTH = np.array(PLAUSIBLE_COEFFICIENTS)
PIXEL_M = 1.0 / 965.0
HALF_PIXEL_M = 0.5 * PIXEL_M


@pytest.mark.parametrize("starts", [1, *later(2)])
def test_without_noise_all_five_are_recovered_from_starts_all_over_the_box(starts: int) -> None:
    fit, _ = fit_coefficients(exact_swims(hz=(0.7, 1.2), seconds=4.5), exact_twin(), (), starts)

    off = np.abs(np.array(fit.coefficients) / TRUTH - 1)
    assert off[:4].max() < 0.02
    assert off[4] < 0.15  # Magnus lift moves the markers least, and Kutta lift roughens the twin
    assert all(np.linalg.norm(end.start / TRUTH - 1) > 0.5 for end in fit.ends)
    assert fit.flags == ()


@pytest.mark.parametrize("off", later(-0.08, 0.05))
def test_a_session_with_another_scale_than_its_robot_spoils_no_coefficient(off: float) -> None:
    length_m, swims = (1 + off) * ROBOT.scale_length_m, exact_swims(hz=(0.7, 1.2), seconds=4.5)
    seen = [replace(at_scale(swim, (1 + off) * swim.metres_per_px), scale_length_m=length_m) for swim in swims]
    fit, _ = fit_coefficients(seen, exact_twin(), (), starts=1)
    assert np.array(fit.coefficients[:4]) == pytest.approx(TRUTH[:4], rel=0.02)


@pytest.mark.parametrize("off", later(-0.05))
def test_nor_does_a_robot_described_with_another_neck_than_it_has(off: float) -> None:
    real = ROBOT.with_scale_length((1 + off) * ROBOT.scale_length_m)
    swims = exact_swims(hz=(0.7, 1.2), seconds=4.5, robot=real)
    seen = [replace(swim, scale_length_m=real.scale_length_m) for swim in swims]
    fit, _ = fit_coefficients(seen, exact_twin(), (), starts=1)
    assert np.array(fit.coefficients[:4]) == pytest.approx(TRUTH[:4], rel=0.02)


def measured(move: Callable[[np.ndarray], np.ndarray], hz: float = 1.0, seconds: float = 5.0) -> MeasuredTrial:
    """A noisy trial as the camera sees it after the pool has been moved under it."""
    trial = exact_swims(hz=(hz,), seconds=seconds, noise_m=HALF_PIXEL_M)[0]
    mirrored = trial.position_m * [1.0, -1.0] / PIXEL_M + 1500.0  # y down
    spec = TrialSpec(name=f"{hz:.2f}", kind="swim", role="fit", commanded_hz=hz)
    tracks = as_tracks(FISHSIM_MARKERS, trial.time_s, move(mirrored), np.ones(mirrored.shape[:2]))
    return measure_trial(spec, tracks, CameraSpec(fps=60.0, scale_length_m=0.142), ROBOT, 1.0)


def turned(angle: float) -> Callable[[np.ndarray], np.ndarray]:
    """A pool turned by an angle (rad) and shifted."""
    cos, sin = np.cos(angle), np.sin(angle)
    return lambda position: position @ np.array([[cos, sin], [-sin, cos]]) + [321.5, -45.25]


@pytest.mark.parametrize("angle", [0.0, 0.7, *later(np.pi, -2.4)])
def test_a_pool_turned_and_shifted_gives_the_same_trial(angle: float) -> None:
    still, moved = measured(lambda position: position), measured(turned(angle))

    np.testing.assert_allclose(moved.head.position_m, still.head.position_m, atol=1e-9)
    np.testing.assert_allclose(moved.start_velocity, still.start_velocity, atol=1e-7)
    assert moved.frequency.hz == pytest.approx(still.frequency.hz, rel=1e-8)
    assert moved.speed == pytest.approx(still.speed, rel=1e-7)
    np.testing.assert_array_equal(moved.weight, still.weight)
    point = np.append(TRUTH, 1.0)[:, None]
    distances = [Swims(exact_twin(), (trial,)).mean_distance(point)[0] for trial in (still, moved)]
    assert distances[1] == pytest.approx(distances[0], rel=1e-6)
