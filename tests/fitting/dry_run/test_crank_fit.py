"""The joint fit finds arm, speed and phase from a wrong start, its errors are honest, and its flags say what is not."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from fitting.crank_fit import CrankFit, crank_response, fit_crank, trial_flags
from fitting.crank_surface import Cell, CrankGrid, JointFit, fit_joint
from fitting.dry_run import DryTrial, TendonUse, measure_dry_run, with_arm
from swimcal.errors import NotEnoughData
from swimcal.session import TrialSpec
from swimcal.tracks import pixels_of
from tests.cases import changed
from tests.fitting.dry_run.runs import CAMERA, NOISELESS, ROBOT, clean_run, dry_trial, shared_response, tracks_of

SMALL = CrankGrid(speeds=21, phases=20)
ARM_M, SLOW, FAST = 0.0382, (0.6, 1.0), (1.19, 4.0)  # speed asked for (Hz) and phase (rad)
WRONG = (Cell(0.036, 0.59, 1.4, np.nan), Cell(0.036, 1.21, 3.6, np.nan))


def both(seed: int) -> tuple[DryTrial, DryTrial]:
    return dry_trial(ARM_M, *SLOW, seed=2 * seed), dry_trial(ARM_M, *FAST, seed=2 * seed + 1)


@lru_cache(maxsize=1)
def fitted() -> CrankFit:
    return fit_crank(both(0), ROBOT, shared_response(), SMALL)


def errors(fit: JointFit) -> tuple[np.ndarray, np.ndarray]:
    """Arm (m), speeds (Hz) and phases (rad) less their truth, and their standard errors."""
    true_hz = [clean_run(ARM_M, *SLOW)[2], clean_run(ARM_M, *FAST)[2]]
    off, error = [fit.arm_m - ARM_M], [fit.arm_se_m]
    for trial, hz, (_, phase) in zip(fit.trials, true_hz, (SLOW, FAST), strict=True):
        off += [trial.hz - hz, trial.phase_rad - phase]
        error += [trial.hz_se, trial.phase_se_rad]
    return np.array(off), np.array(error)


def test_from_a_wrong_start_without_noise_it_ends_at_the_truth() -> None:
    trials = [dry_trial(ARM_M, *part, noise=NOISELESS) for part in (SLOW, FAST)]
    off, _ = errors(fit_joint(trials, shared_response(), WRONG))

    assert abs(off[0]) < 1e-5
    assert np.abs(off[[1, 3]]).max() < 5e-5
    assert np.degrees(np.abs(off[[2, 4]])).max() < 0.1


@pytest.mark.long
def test_misplaced_boxes_move_the_published_arm_but_not_the_joint_one() -> None:
    fit = fitted()

    assert abs(fit.arm_published_m - ARM_M) > 1e-3
    assert fit.arm_published_m == pytest.approx(np.mean(fit.arm_per_trial_m))
    assert abs(fit.arm_m - ARM_M) < 4 * fit.arm_se_m


def test_missing_and_flagged_samples_are_left_out() -> None:
    trial = dry_trial(ARM_M, *SLOW, noise=NOISELESS)
    place, weight = trial.place_m.copy(), trial.weight.copy()
    place[50:120, 6] = np.nan
    place[130:150, 8] += 0.4
    weight[50:120, 6] = weight[130:150, 8] = 0.0
    found = fit_joint([replace(trial, place_m=place, weight=weight)], shared_response(), WRONG[:1])

    assert found.arm_m == pytest.approx(ARM_M, abs=5e-5)


@pytest.mark.long
def test_its_95_percent_intervals_hold_the_truth_about_as_often() -> None:
    results = [errors(fit_joint(both(seed), shared_response(), WRONG)) for seed in range(200)]
    off, error = (np.array(part) for part in zip(*results, strict=True))  # (200, 5)
    covered = (np.abs(off / error) < 1.96).mean(axis=0)

    assert ((covered >= 0.90) & (covered <= 0.985)).all(), covered  # three standard deviations of 200 draws
    assert (np.abs(np.mean(off / error, axis=0)) < 0.25).all()
    assert np.sqrt((off[:, 0] ** 2).mean()) < 1e-4


def kinds(fit: CrankFit) -> set[str]:
    return {flag.kind for flag in (*fit.flags, *fit.trials[0].flags)}


def test_only_tendons_unlike_those_of_the_built_in_robot_are_flagged() -> None:
    first = fitted().trials[0]
    odd = replace(first, tendons=TendonUse(0.05, 0.02, 0.95))
    flags = {flag.kind: flag.message for flag in trial_flags(odd, (0.03, 0.0415))}

    assert first.tendons.slack_share > 0.5
    assert first.tendons.stretch < 0.001
    assert "a string would be slack there, the twin's springs push" in flags["tendon_pushes"]
    assert "published are about 3 %" in flags["tendon_stretch"]


@pytest.mark.parametrize(
    ("arm_m", "part", "seconds", "kind", "message"),
    [
        (0.036, SLOW, 5.0, None, ""),
        (0.027, SLOW, 5.0, "at_bound", "29.63 mm, is at the end of its range, the edge of the grid"),
        (0.0414, FAST, 5.0, "at_bound", "with a longer one the twin's tail snaps over"),
        (ARM_M, SLOW, 3.2, "too_short", "only 2.2 s, 1.3 turns of the crank"),
    ],
    ids=["good", "edge of the grid", "before the snap", "short"],
)
def test_a_run_that_holds_too_little_is_flagged_and_a_good_one_is_not(
    arm_m: float, part: tuple[float, float], seconds: float, kind: str | None, message: str
) -> None:
    fit = fit_crank([dry_trial(arm_m, *part, noise=NOISELESS, seconds=seconds)], ROBOT, shared_response(), SMALL)

    reported = [(flag.kind, flag.message) for flag in (*fit.flags, *fit.trials[0].flags)]
    assert any(each[0] == kind and message in each[1] for each in reported) if kind else not reported


@pytest.mark.long
@pytest.mark.parametrize(("described_m", "true_m"), [(0.0395, 0.0265), (0.0265, 0.0382)])
def test_an_arm_far_from_the_described_one_is_found(described_m: float, true_m: float) -> None:
    robot = with_arm(ROBOT, described_m)
    runs = [dry_trial(true_m, *SLOW, robot=robot), dry_trial(true_m, *FAST, seed=1, robot=robot)]
    fit = fit_crank(runs, robot, crank_response(runs, robot, SMALL), SMALL)

    assert fit.arm_m == pytest.approx(true_m, abs=3e-4)
    assert abs(fit.arm_m - true_m) < 3 * fit.arm_se_m
    assert "at_bound" not in {flag.kind for flag in fit.flags}


def test_a_nose_marked_off_its_place_is_seen_by_the_scale() -> None:
    tracks = tracks_of(ARM_M, *SLOW, seed=0, noise=NOISELESS)
    axis = pixels_of(tracks)[0, 1] - pixels_of(tracks)[0, 0]
    position_px = pixels_of(tracks).copy()
    position_px[:, 0] += 0.08 * axis
    spec = TrialSpec("dry", "dry", commanded_hz=0.6)
    trial = measure_dry_run(spec, changed(tracks, position_px=position_px), CAMERA, ROBOT)
    fit = fit_crank([trial], ROBOT, shared_response(), SMALL)

    assert "scale_off_robot" in kinds(fit)
    assert fit.arm_m == pytest.approx(ARM_M, abs=6e-4)
    assert abs(fit.arm_published_m - ARM_M) > 1e-3


def test_no_run_and_one_that_ends_in_its_warm_up_are_refused() -> None:
    with pytest.raises(NotEnoughData, match='at least one trial with kind = "dry"'):
        fit_crank([], ROBOT, shared_response())
    spec = TrialSpec("dry", "dry", commanded_hz=0.6)
    with pytest.raises(NotEnoughData, match=r"trial dry: 1.00 s leave 1 frames after 1 s of warm-up"):
        measure_dry_run(spec, tracks_of(ARM_M, *SLOW, seed=0, seconds=1.0), CAMERA, ROBOT)


def test_a_head_that_is_not_clamped_is_seen() -> None:
    tracks = tracks_of(ARM_M, *SLOW, seed=0, noise=NOISELESS)
    moved = pixels_of(tracks) + 15.0 * np.sin(4.0 * tracks.time.values)[:, None, None]
    spec = TrialSpec("dry", "dry", commanded_hz=0.6)
    trial = measure_dry_run(spec, changed(tracks, position_px=moved), CAMERA, ROBOT)

    assert "head_moves" in [flag.kind for flag in trial.flags]
    assert "head_moves" not in [flag.kind for flag in both(0)[0].flags]


def test_a_tail_that_moves_otherwise_is_reported() -> None:
    """Half the fin's swing is taken away, which no crank does."""
    tracks = tracks_of(0.036, *SLOW, seed=0, noise=NOISELESS)
    position_px = pixels_of(tracks).copy()
    position_px[:, -3:] = (position_px[:, -3:] + position_px[:, -3:].mean(axis=0)) / 2
    trial = dry_trial(0.036, *SLOW, noise=NOISELESS)
    spoilt = position_px @ np.array([[1, 0], [0, -1]]) * 0.142 / np.linalg.norm(position_px[0, 1] - position_px[0, 0])
    place_m = (spoilt[..., 0] + 1j * spoilt[..., 1])[-len(trial.time_s) :]
    fit = fit_crank([replace(trial, place_m=place_m)], ROBOT, shared_response(), SMALL)

    (flag,) = [flag for flag in fit.trials[0].flags if flag.kind == "poor_fit"]
    assert "the twin's tail moves otherwise than the measured one" in flag.message
