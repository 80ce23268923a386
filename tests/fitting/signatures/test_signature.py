"""What an effect is told to do to a session is what a session does in which it is present."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.affected_trials import view_of
from fitting.session_model import SessionModel
from fitting.signatures import signature_of, strengths
from fitting.trial_model import START_PHASE_RAD, TrialModel, sensitivities_together
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.measurement import MarkerOffset, MarkerSwap, RollingShutter, TimeBaseError
from swimcal.session_file import CameraCalibration, CameraSpec
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import ROBOT, exact_swims, exact_twin

TRUTH = np.array(PLAUSIBLE_COEFFICIENTS, float)
CAMERA = CameraSpec(fps=60.0, scale_length_m=ROBOT.scale_length_m)


@pytest.fixture(scope="module")
def model() -> SessionModel:
    trials = exact_swims(hz=(0.7, 1.1), seconds=3.5)
    return SessionModel(tuple(TrialModel(exact_twin(workers=1), trial, START_PHASE_RAD) for trial in trials))


def test_a_marker_glued_elsewhere_is_the_column_of_the_posterior(model: SessionModel) -> None:
    marker = FISHSIM_MARKERS.index("tail_3")
    effect = MarkerOffset(FISHSIM_MARKERS)
    values = np.zeros((1, len(effect.parameters)))
    values[0, [p.name for p in effect.parameters].index("tail_3_across")] = 0.001
    found = signature_of(effect, model, CAMERA, TRUTH, values).features[0]
    column = np.concatenate(
        [0.001 * each.markers[:, 2 * marker + 1] for each in sensitivities_together(model.trials, TRUTH)]
    )
    assert found == pytest.approx(column, abs=0.02 * np.abs(column).max())


def test_a_wrong_clock_is_seen_in_the_commanded_frequency(model: SessionModel) -> None:
    signature = signature_of(TimeBaseError(), model, CAMERA, TRUTH, np.array([[0.02], [-0.01]]))
    assert signature.beside == pytest.approx(np.array([[0.014, 0.022], [-0.007, -0.011]]))


def test_each_parameter_is_tried_either_way_within_its_bounds() -> None:
    assert strengths(TimeBaseError()).ravel() == pytest.approx([-0.06, -0.02, 0.02, 0.06])
    assert strengths(RollingShutter()).ravel() == pytest.approx([0.01, 0.03])
    assert strengths(MarkerOffset(("nose", "neck", "tail_1"))).shape == (8, 2)
    assert strengths(MarkerSwap(("tail_1",))).shape == (0, 0)


def test_the_view_stands_over_the_same_point_of_the_pool(model: SessionModel) -> None:
    trial = model.trials[0].trial
    lens = CameraCalibration(width_px=1000, height_px=800, fx_px=900.0, fy_px=900.0, cx_px=500.0, cy_px=400.0)
    camera = CameraSpec(fps=60.0, scale_length_m=ROBOT.scale_length_m, calibration=lens)
    to_pool, origin = np.array([[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]]), np.array([0.7, -0.2])
    in_its_own_frame = (trial.position_m[trial.kept] - origin) @ to_pool
    view = view_of(trial, in_its_own_frame, camera)
    assert origin + to_pool @ view.axis_m == pytest.approx(np.array([500.0, -400.0]) * trial.metres_per_px)
    assert to_pool @ view.down == pytest.approx([0.0, -1.0])
    assert view.half_height_m == pytest.approx(400 * trial.metres_per_px)
