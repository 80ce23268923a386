"""The twin's free decay against the linear chain, worked out without the engine, and against a finer step."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.hinges import STEPS_S, DecayTwin, stable_scene
from tests.fitting.free_decay.chain import linear_decay
from tests.fitting.free_decay.decays import MARKERS, ROBOT, Truth, swings

TIME_S = np.arange(60) / 60.0
TWIN = DecayTwin(ROBOT, MARKERS, workers=1)


def decay(stiffness: float, damping: float, bent: np.ndarray, twin: DecayTwin = TWIN) -> np.ndarray:
    start = np.stack([bent, np.zeros_like(bent)])[None]
    return twin(np.array([stiffness]), np.array([damping]), start, TIME_S)[0]


@pytest.mark.parametrize("damping", [0.02, 0.004])
def test_small_swings_are_those_of_the_linear_chain(damping: float) -> None:
    bent = 1e-3 * np.array(Truth().bent_rad)
    hinges = linear_decay(ROBOT, 0.5, damping, bent, TIME_S)

    swing = decay(0.5, damping, bent)[..., 1]

    exact = TWIN.markers_at(hinges)[..., 1]
    assert np.abs(swing - exact)[2:].max() < 2e-3 * np.abs(exact).max()


def test_a_step_taken_off_is_as_good_as_a_much_finer_one() -> None:
    truth = Truth(release_s=0.0, seconds=1.0)

    coarse = decay(truth.stiffness_n_m, truth.damping_n_m_s, np.array(truth.bent_rad))

    fine = swings([truth], step_s=0.0002)[0]
    assert np.abs(coarse - fine)[2:].max() < 2e-4


def test_lightly_damped_hinges_get_a_step_that_is_stable() -> None:
    assert stable_scene(0.03).timestep_s == STEPS_S[0]
    scene = stable_scene(1e-5)

    swing = decay(0.65, 0.65e-5, np.array(Truth().bent_rad), DecayTwin(ROBOT, MARKERS, scene, workers=1))

    assert np.isfinite(swing).all()
