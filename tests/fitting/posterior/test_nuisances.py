"""What a nuisance does to features is what a simulation shows that is displaced by it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting.features import advance_phase, phase_between
from fitting.picture_scale import box_columns
from fitting.pool import CommonScale
from fitting.trial_model import START_SD, Sensitivities, TrialModel, sensitivities_together
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.robot import RobotSpec
from swimcal.runs import Runs
from swimcal.twin import Twin
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import ROBOT, exact_swims, exact_twin

TRUTH = np.array(PLAUSIBLE_COEFFICIENTS, float)
NOSE, NECK, FIN = (FISHSIM_MARKERS.index(name) for name in ("nose", "neck", "caudal_fin"))


@pytest.fixture(scope="module")
def model() -> TrialModel:
    return TrialModel(exact_twin(), exact_swims(hz=(1.0,), seconds=4.0)[0], 1.0)


@pytest.fixture(scope="module")
def sensitivities(model: TrialModel) -> Sensitivities:
    return sensitivities_together([model], TRUTH)[0]


def simulated(model: TrialModel, velocity: np.ndarray, hz: float = 1.0, robot: RobotSpec = ROBOT) -> np.ndarray:
    """(n, m, 2) in the kept frames, of a robot with other markers, say."""
    runs = Runs(TRUTH[None], np.array([hz]), np.array([model.phase_rad]), velocity[None])
    twin = Twin(robot, FISHSIM_MARKERS)
    return twin.simulate(runs, model.trial.time_s).marker_m[0, model.trial.kept]


def read(model: TrialModel, marker_m: np.ndarray) -> np.ndarray:
    """(k,) in step with what was measured."""
    features = model.reader(marker_m)
    return advance_phase(features, phase_between(features, model.measured, list(model.trial.tail)))


def rescaled(marker_m: np.ndarray, like_m: np.ndarray) -> np.ndarray:
    """As tracks are, by the distance from nose to neck."""
    length, wanted = (np.linalg.norm(m[:, NOSE] - m[:, NECK], axis=-1).mean() for m in (marker_m, like_m))
    return marker_m * wanted / length


def test_the_simulated_features_at_the_truth_is_the_measured_one(model: TrialModel) -> None:
    features = model.simulated(TRUTH[None])[0]
    assert features[1:] == pytest.approx(model.measured[1:], abs=2e-3)
    assert features[0] == pytest.approx(model.measured[0], abs=3e-3)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_start_moves_it_as_a_simulation_from_another_start(
    model: TrialModel, sensitivities: Sensitivities, axis: int
) -> None:
    start, shift = model.trial.start_velocity, np.eye(3)[axis] * START_SD[axis]
    up, down = (read(model, simulated(model, start + sign * shift)) for sign in (0.5, -0.5))
    assert sensitivities.own[:, axis] == pytest.approx(up - down, abs=0.05 * np.abs(up - down).max())


def test_the_frequency_moves_it_as_a_crank_that_turns_faster(model: TrialModel, sensitivities: Sensitivities) -> None:
    start, relative = model.trial.start_velocity, model.trial.frequency.se_hz / model.trial.frequency.hz
    up, down = (read(model, simulated(model, start, 1.0 + sign * 0.005)) for sign in (1, -1))
    expected = relative * (up - down) / 0.01
    assert sensitivities.own[:, 3] == pytest.approx(expected, abs=0.05 * np.abs(expected).max())


@pytest.mark.parametrize("marker", [NOSE, NECK, 4, FIN])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_box_off_its_marker_moves_it_with_scale_and_heading(
    model: TrialModel, sensitivities: Sensitivities, marker: int, axis: int
) -> None:
    marker_m = simulated(model, model.trial.start_velocity)
    shifted = marker_m.copy()
    shifted[:, marker, axis] += 5e-4
    expected = 2000 * (read(model, rescaled(shifted, marker_m)) - read(model, marker_m))
    place = 2 * marker + axis
    column = sensitivities.boxes[:, place] + sensitivities.scale[:, 0] * sensitivities.spans[place]
    assert column == pytest.approx(expected, abs=0.02 * np.abs(expected).max())


@pytest.mark.parametrize("marker", [NOSE, NECK])
def test_a_box_of_nose_or_neck_scales_every_trial_with_the_same_scale(
    model: TrialModel, sensitivities: Sensitivities, marker: int
) -> None:
    common = CommonScale(0.001, ("own", "other", "absent"))
    windows = [replace(model, trial=replace(model.trial, name=name, scale=common)) for name in ("own", "other")]
    columns = box_columns(windows, [sensitivities] * 2)[:, 2 * marker].reshape(2, -1)

    marker_m = simulated(model, model.trial.start_velocity)
    shifted = marker_m.copy()
    shifted[:, marker, 0] += 5e-4
    third = np.linalg.norm(rescaled(shifted, marker_m)[0]) / np.linalg.norm(shifted[0])
    third **= 1 / 3  # the logarithm of the common scale is a mean of three
    for column, seen in zip(columns, (shifted, marker_m), strict=True):
        expected = 2000 * (read(model, third * seen) - read(model, marker_m))
        assert column == pytest.approx(expected, abs=0.02 * np.abs(expected).max())


def test_a_trial_that_is_not_fitted_doubts_its_scale_by_the_boxes_of_those_that_are(
    model: TrialModel, sensitivities: Sensitivities
) -> None:
    common = CommonScale(0.001, ("a", "b"))
    new = replace(model, trial=replace(model.trial, name="new", role="holdout", scale=common))
    of_absent = box_columns([new], [sensitivities])[:, -2:]
    doubt = np.linalg.norm(of_absent, axis=1)
    assert doubt == pytest.approx(np.abs(sensitivities.scale[:, 0]) / ROBOT.scale_length_m, rel=0.03)


@pytest.mark.parametrize("name", ["nose", "neck", "tail_2", "caudal_fin"])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_marker_glued_off_its_place_moves_it_as_a_robot_made_so(
    model: TrialModel, sensitivities: Sensitivities, name: str, axis: int
) -> None:
    off = np.eye(3)[axis] * 0.001
    marker = ROBOT.markers[name].model_copy(update={"position_m": tuple(np.add(ROBOT.markers[name].position_m, off))})
    robot = ROBOT.model_copy(update={"markers": ROBOT.markers | {name: marker}})
    marker_m = simulated(model, model.trial.start_velocity)
    shifted = rescaled(simulated(model, model.trial.start_velocity, robot=robot), marker_m)
    expected = read(model, shifted) - read(model, marker_m)
    column = 0.001 * sensitivities.markers[:, 2 * FISHSIM_MARKERS.index(name) + axis]
    sign = np.sign(column @ expected)  # each way along an axis is as likely
    assert sign * column == pytest.approx(expected, abs=0.02 * np.abs(expected).max())
