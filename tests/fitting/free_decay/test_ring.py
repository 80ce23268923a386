"""A free decay in two numbers: they are those of the robot that was filmed, and as sure as they say."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr

from fitting.decay_fit import fit_decay
from fitting.free_decay import measure_decay_trial
from fitting.hinges import with_hinges
from fitting.ring import Ring, shows_in_decays
from swimcal.effects.catalogue import catalogue
from swimcal.robot import RobotSpec
from swimcal.tracks import pixels_of
from swimcal.twin import Twin
from tests.cases import changed
from tests.fitting.free_decay.decays import CAMERA, MARKERS, ROBOT, Truth, decay_tracks

TRUTH = Truth()


def robot(stiffer: float = 0.0, damped: float = 0.0) -> RobotSpec:
    """As it was let go, but for shares of its hinges."""
    return with_hinges(ROBOT, TRUTH.stiffness_n_m * (1 + stiffer), TRUTH.damping_n_m_s * (1 + damped))


def twin(described: RobotSpec) -> Twin:
    return Twin(described, MARKERS, workers=1)


def ring(described: RobotSpec, seed: int = 0, tracks: xr.Dataset | None = None) -> Ring:
    trial = measure_decay_trial("decay", tracks or decay_tracks(TRUTH, seed), CAMERA, ROBOT)
    return Ring.of(trial, fit_decay(trial, described, workers=1), described)


@cache
def first() -> Ring:
    return ring(robot())


@pytest.mark.parametrize(("stiffer", "damped"), [(0.0, 0.0), (-0.1, 0.0), (0.2, 0.4), (0.0, 2.0), (-0.8, 9.0)])
def test_it_leaves_by_how_much_the_hinges_are_not_as_described(stiffer: float, damped: float) -> None:
    """However far off they are: a tail that is described as creeping may ring."""
    seen = ring(robot(stiffer, damped))
    assert np.abs((seen.residual + np.log1p([stiffer, damped])) / seen.sd).max() < 3.5
    reported = seen.of_twin(twin(robot(stiffer, damped)), [catalogue()["joint_damping"]], np.array([[0.0], [0.5]]))
    assert reported == pytest.approx(np.array([[0.0, 0.0], [0.0, np.log(1.5)]]), abs=0.03)


@pytest.mark.long
def test_a_sample_that_no_tracking_error_explains_hardly_moves_it() -> None:
    tracks = decay_tracks(TRUTH)
    position = np.array(pixels_of(tracks))
    position[45, MARKERS.index("tail_3")] += 66.0
    seen = ring(robot(), tracks=changed(tracks, position_px=position))
    assert np.abs(seen.residual / seen.sd).max() < 3.5
    assert (seen.sd < 1.5 * first().sd).all()
    assert (seen.trial.weight == 0).sum() > (first().trial.weight == 0).sum()


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("stiffness_error", 0.1, (np.log(1.1), 0.0)),
        ("joint_damping", 0.3, (0.0, np.log(1.3))),
        ("time_base_error", 0.02, (2 * np.log(1.02), np.log(1.02))),
        ("bend_offset", 0.03, (0.0, 0.0)),
    ],
)
def test_effects_move_it_as_hinges_and_clocks_do(name: str, value: float, expected: tuple[float, float]) -> None:
    """Nearly: a tail that rests bent rings about as damped as one that rests straight, to 3 %."""
    effect, plain = catalogue()[name], twin(robot())
    reported = first().of_twin(plain, [effect], np.array([[0.0], [value]]))
    assert reported[0] == pytest.approx(np.zeros(2), abs=1e-4)
    assert reported[1] - reported[0] == pytest.approx(np.array(expected), abs=0.035)


def test_it_tells_of_hinges_masses_and_the_clock_alone() -> None:
    shown = {name: effect for name, effect in catalogue().items() if shows_in_decays(effect)}
    structure = {name for name, effect in catalogue().items() if effect.family == "structure"}
    assert structure - set(shown) == {"entrained_water"}
    assert set(shown) - structure == {"time_base_error"}
