"""A crank that turns unevenly starts where it was: its fast and slow parts belong to angles of the crank."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting.features import SPEED
from fitting.trial import MeasuredTrial
from fitting.trial_model import START_PHASE_RAD, TrialModel
from swimcal.runs import CrankTurn, Runs
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import FPS, exact_twin, measured_swim

HZ, SECONDS = 1.2, 6.0
AT = np.array([PLAUSIBLE_COEFFICIENTS], float)


def uneven(phase_rad: float) -> CrankTurn:
    """Return a turn that is a tenth faster where the crank is sideways than where the tail is straight."""
    time_s = np.arange(-0.5, SECONDS + 0.5, 0.005)
    angle = 2 * np.pi * HZ * time_s
    return CrankTurn.measured(time_s, angle - 0.05 * np.sin(2 * (angle + phase_rad)))


def logged_swim(phase_rad: float) -> MeasuredTrial:
    twin, time_s = exact_twin(workers=1), np.arange(round(SECONDS * FPS) + 1) / FPS
    turn = uneven(phase_rad)
    runs = Runs(AT, np.array([HZ]), np.array([phase_rad]), np.array([[-0.1, 0.0, 0.0]]), turns=(turn,))
    return replace(measured_swim("logged", HZ, twin.simulate(runs, time_s).marker_m[0]), turn=turn)


@pytest.mark.parametrize("phase_rad", [0.3, 1.7, 2.9, 4.4])
def test_wherever_the_crank_starts_the_true_twin_swims_as_measured(phase_rad: float) -> None:
    trial = logged_swim(phase_rad)
    model = TrialModel.of(exact_twin(workers=1), trial)
    (found,) = model.simulated(AT)
    assert abs(found[SPEED] / model.measured[SPEED] - 1) < 0.004
    assert np.abs(found - model.measured)[1:].max() < 0.4e-3


def test_a_ripple_at_another_angle_is_another_swim() -> None:
    trial = logged_swim(START_PHASE_RAD + np.pi / 2)
    model = TrialModel(exact_twin(workers=1), trial, START_PHASE_RAD)
    (found,) = model.simulated(AT)
    assert abs(found[SPEED] / model.measured[SPEED] - 1) > 0.01


def test_a_crank_that_turns_evenly_may_start_anywhere() -> None:
    trial = replace(logged_swim(0.3), turn=None)
    assert TrialModel.of(exact_twin(workers=1), trial).phase_rad == START_PHASE_RAD
