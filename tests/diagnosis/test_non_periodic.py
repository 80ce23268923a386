"""Motion beside the beat and beats that keep no time are told from noise of markers and from each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from diagnosis.non_periodic import NonPeriodicSize, non_periodic
from diagnosis.verdict import verdict_of
from fitting import MeasuredTrial
from tests.diagnosis.rows import K, after, hypotheses
from tests.fitting.exact_swims import exact_swims

NOISE_M, SWAY_M = 5e-4, 1e-3
LASTS_S = 0.1


@lru_cache(maxsize=1)
def swims() -> tuple[MeasuredTrial, ...]:
    return exact_swims(hz=(0.7, 1.1), seconds=6.0)


def moved(by_m: list[np.ndarray]) -> list[MeasuredTrial]:
    """The swims with something added to their markers (n, m, 2)."""
    pairs = zip(swims(), by_m, strict=True)
    return [trial.seen_as(position_m=trial.position_m + each) for trial, each in pairs]


def noise(random: np.random.Generator) -> list[np.ndarray]:
    """Of each marker by itself, lasting for some frames."""
    return [NOISE_M * lasting(trial, trial.position_m.shape[1:], LASTS_S, random) for trial in swims()]


def lasting(trial: MeasuredTrial, shape: tuple[int, ...], scale_s: float, random: np.random.Generator) -> np.ndarray:
    """(n, *shape) of unit variance, whose correlation falls to 1/e in a time."""
    time_s = trial.time_s
    root = np.linalg.cholesky(np.exp(-np.abs(time_s[:, None] - time_s) / scale_s) + 1e-9 * np.eye(len(time_s)))
    return (root @ random.standard_normal((len(time_s), int(np.prod(shape))))).reshape(len(time_s), *shape)


def sway_of(trials: Sequence[MeasuredTrial]) -> NonPeriodicSize:
    return non_periodic(trials).motion


def delay_of(trials: Sequence[MeasuredTrial]) -> NonPeriodicSize:
    return non_periodic(trials).delay


def test_noise_of_markers_is_no_sway_and_makes_no_beat_late() -> None:
    random = np.random.default_rng(1)
    for shaken in (swims(), *(moved(noise(random)) for _ in range(20))):
        assert sway_of(shaken).log_odds < 0.0
        assert delay_of(shaken).log_odds < 0.0


@pytest.mark.parametrize("turning", [False, True])
def test_the_whole_fish_swaying_is_found_with_its_size(turning: bool) -> None:
    random, shaken, sizes = np.random.default_rng(2), [], []
    for trial, own in zip(swims(), noise(random), strict=True):
        sway = SWAY_M * lasting(trial, (1, 2), 0.5, random) * np.ones((1, len(trial.markers), 1))
        if turning:
            arm = trial.position_m - trial.position_m.mean(axis=1, keepdims=True)
            angle = sway[:, :, :1] / np.abs(arm).mean()
            sway = angle * np.stack([-arm[..., 1], arm[..., 0]], axis=-1)
        shaken.append(own + sway)
        sizes.append(np.sqrt(2 * np.mean(sway**2)))
    found = sway_of(moved(shaken))
    assert found.log_odds > 20.0
    assert 0.3 * np.mean(sizes) < found.rms < 1.2 * np.mean(sizes)  # what is slow passes for the fish's own path


def test_the_same_motion_of_each_marker_by_itself_is_noise() -> None:
    random = np.random.default_rng(3)
    own = [SWAY_M * lasting(trial, trial.position_m.shape[1:], 0.5, random) for trial in swims()]
    assert sway_of(moved(own)).log_odds < 0.0


def late(delay_s: Callable[[np.ndarray], np.ndarray]) -> list[MeasuredTrial]:
    """The swims, noisy, with every frame later by a delay (n,) at times (n,), s."""
    by_m = [
        own - delay_s(trial.time_s)[:, None, None] * np.gradient(trial.position_m, trial.time_s, axis=0)
        for trial, own in zip(swims(), noise(np.random.default_rng(4)), strict=True)
    ]
    return moved(by_m)


def frames_lost(time_s: np.ndarray) -> np.ndarray:
    """One and a half frames at 60 a second, three times."""
    return np.asarray(0.025 * sum((time_s > when).astype(float) for when in (1.7, 3.1, 4.4)))


def test_lost_frames_make_beats_late_with_their_size() -> None:
    found = delay_of(late(frames_lost))
    assert found.log_odds > 10.0
    assert 0.001 < found.rms < 0.01  # most of a staircase is a slope, which a frequency takes
    assert sway_of(late(frames_lost)).log_odds < found.log_odds  # within a stretch a step is no delay of all of it


def test_wandering_clocks_and_warming_motors_are_no_motion() -> None:
    assert sway_of(late(lambda time_s: 0.02 * np.sin(2 * np.pi * time_s / 3.0))).log_odds < 0.0
    assert delay_of(late(lambda time_s: 0.05 * (1 - np.exp(-time_s / 4.0)))).log_odds < 0.0


def test_it_speaks_for_something_else_and_its_absence_hardly_against() -> None:
    quiet = hypotheses(np.random.default_rng([0, 5]).standard_normal(K))
    none, shaken, still = (after(replace(quiet, non_periodic=(0.0, odds))) for odds in (0.0, 50.0, -50.0))
    assert verdict_of(none).name == "no_gap"
    assert verdict_of(shaken).name == "unexplained"
    assert shaken.with_other > 0.999
    assert none.with_other > still.with_other > 0.75 * none.with_other
    assert replace(quiet, non_periodic=(-5.0, 50.0)).shares_non_periodic == pytest.approx((0.0, 1.0), abs=1e-3)
