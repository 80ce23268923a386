"""The error of the time step points where the features of a swim in fine steps are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fitting.mode import time_step_errors
from fitting.session_model import SessionModel
from fitting.trial_model import simulated_together, trajectories_together
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import exact_swims, exact_twin

AT = np.array(PLAUSIBLE_COEFFICIENTS, float)


def test_with_it_whole_steps_swim_as_much_finer_ones_do() -> None:
    model = SessionModel.of(exact_twin(workers=1), exact_swims(hz=(0.8, 1.6), seconds=4.0))
    motions = trajectories_together(model.trials, AT[None])
    finest = exact_twin(workers=1).at_step(model.trials[0].twin.scene.timestep_s / 20)
    fine = simulated_together([replace(trial, twin=finest) for trial in model.trials], AT[None])
    lacks = [
        after[0] - trial.features_of(motion)[0]
        for trial, motion, after in zip(model.trials, motions, fine, strict=True)
    ]
    for told, true in zip(time_step_errors(model.trials, AT, motions), lacks, strict=True):
        assert np.linalg.norm(told - true) < 0.15 * np.linalg.norm(true)
