"""Drawn sessions hold a truth from the prior that the twin of the session does not know all of."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.posterior import truth as posterior_truth
from benchmarks.posterior.truth import DrawnSession, draw_session
from fitting.features import COURSE, harmonics_of
from fitting.phase import speed_from_rest
from fitting.session_model import SessionModel
from swimcal.robot import load_robot

COARSE = 1 / 8  # so that a draw takes no seconds


@pytest.fixture(scope="module")
def drawn() -> DrawnSession:
    return draw_session(3, seconds=3.0, step=COARSE)


@pytest.mark.long
def test_a_seed_draws_the_same_session_again(drawn: DrawnSession) -> None:
    again = draw_session(3, seconds=3.0, step=COARSE)
    assert again.truth == drawn.truth
    assert again.trials[0].position_m == pytest.approx(drawn.trials[0].position_m, nan_ok=True)


@pytest.mark.long
def test_the_share_of_the_noise_in_common_changes_nothing_else(
    drawn: DrawnSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(posterior_truth, "MOST_SHARED", 0.0)
    apart = draw_session(3, seconds=3.0, step=COARSE)
    assert (0 < drawn.noise.shared < 0.8, apart.noise.shared) == (True, 0.0)
    assert apart.noise.model_copy(update={"shared": drawn.noise.shared}) == drawn.noise
    assert (apart.truth, apart.robot) == (drawn.truth, drawn.robot)
    moved = apart.trials[0].position_m - drawn.trials[0].position_m
    assert 1e-4 < np.nanstd(moved) < 2e-3
    assert np.abs(np.nanmean(moved, axis=0)).max() < 1.5e-3  # boxes sit where they sat


def test_the_truth_lies_in_the_box_and_swims_forward(drawn: DrawnSession) -> None:
    truth, hz = np.array(drawn.truth), np.array([trial.frequency.hz for trial in drawn.trials])
    assert ((truth >= 0) & (truth <= 10)).all()
    assert (speed_from_rest(drawn.twin, truth[None], hz) > 0).all()
    assert hz.min() > 0.49
    assert hz.max() < 1.41
    assert abs(np.diff(hz)[0]) > 0.29


def test_the_twin_has_its_markers_in_their_places(drawn: DrawnSession) -> None:
    assert drawn.twin.robot == load_robot()
    model = SessionModel.of(drawn.twin, drawn.trials)
    off = model.measured - model.simulated(np.array(drawn.truth)[None])[0]
    assert 2e-3 < np.abs(off).max() < 0.05  # boxes are 2 mm off in the mean


def test_what_nobody_measured_of_the_robot_is_off(drawn: DrawnSession) -> None:
    known, swam = drawn.twin.robot, drawn.robot
    assert 0 < abs(swam.tail.hinge_stiffness_n_m / known.tail.hinge_stiffness_n_m - 1) < 0.4
    assert 0 < abs(swam.tail.hinge_damping_n_m_s / known.tail.hinge_damping_n_m_s - 1) < 0.8
    assert 0 < abs(swam.crank.arm_m / known.crank.arm_m - 1) < 0.08


@pytest.mark.long
def test_trials_of_a_varied_session_differ_in_trim_registration_and_speed_and_in_nothing_else(
    drawn: DrawnSession,
) -> None:
    varied = draw_session(3, seconds=3.0, step=COARSE, varied=True)
    assert (varied.truth, varied.robot, varied.noise) == (drawn.truth, drawn.robot, drawn.noise)
    faster = [b.speed / a.speed - 1 for a, b in zip(drawn.trials, varied.trials, strict=True)]
    assert 0.003 < np.abs(np.diff(faster)[0]) < 0.15
    plain, other = (
        [model.measured for model in SessionModel.of(each.twin, each.trials, with_course=True).trials]
        for each in (drawn, varied)
    )
    moved = np.array(other) - np.array(plain)
    sideways, turning = moved[:, -len(COURSE) :].T
    assert (np.abs(turning) > 0.002).all()
    assert (np.abs(turning) < 0.1).all()
    assert np.abs(sideways).max() < 0.02
    beats = harmonics_of(moved)
    assert np.abs(beats[..., 2:, :, :]).max() < 2e-3  # neither nose nor neck


@pytest.mark.long
def test_markers_of_a_gapped_session_are_unseen_for_a_while_and_the_rest_stays(drawn: DrawnSession) -> None:
    gapped = draw_session(3, seconds=3.0, step=COARSE, gapped=True)
    for whole, trial in zip(drawn.trials, gapped.trials, strict=True):
        seen = np.isfinite(trial.position_m).all(axis=-1)
        unseen = 1 - seen.mean(axis=0)  # (m,)
        assert (unseen > 0).all()
        assert unseen.max() > 0.1
        assert abs(trial.frequency.hz - whole.frequency.hz) < 0.01
    assert (gapped.truth, gapped.robot) == (drawn.truth, drawn.robot)
