"""Where steps would cross the boundary of twins that swim forward from rest, the search follows it to the optimum."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.optimize import minimize

from fitting import descent as descents
from fitting.descent import Descent, Place

SLOPES = np.linalg.qr(np.random.default_rng(5).standard_normal((12, 5)))[0] * [9.0, 7.0, 5.0, 4.0, 3.0]
BEST = np.array([3.0, 4.0, 5.0, 2.0, 3.0])  # the best of all coefficients; with these the twin swims backward
BEGIN = np.array([5.0, 5.0, 6.0, 5.0, 5.5])
ROUNDS = 40


def margin(points: np.ndarray) -> np.ndarray:
    """(s,) above 0 where the twin swims forward: a curved boundary."""
    return np.asarray(points[:, 3] + 0.5 * points[:, 4] - 5.0 - 0.05 * (points[:, 0] - 4.0) ** 2)


def misfit(point: np.ndarray) -> float:
    """Half the squares that a point leaves."""
    return 0.5 * float(((SLOPES @ (BEST - point)) ** 2).sum())


class Swum(NamedTuple):
    """What points (s, 5) simulate."""

    points: np.ndarray
    time_s: np.ndarray = np.zeros(1)

    def part(self, rows: np.ndarray, _frames: int) -> Swum:
        return Swum(self.points[rows])


@pytest.fixture
def descent(monkeypatch: pytest.MonkeyPatch) -> Descent:
    """Of a twin that is linear in its coefficients."""
    trial: Any = SimpleNamespace(features_of=lambda swum: swum.points @ SLOPES.T)
    monkeypatch.setattr(descents, "trajectories_together", lambda _trials, points: [Swum(points)])
    found = object.__new__(Descent)
    model = SimpleNamespace(trials=[trial], measured=SLOPES @ BEST, swim_forward=lambda points: margin(points) > 0)
    own = {"model": model, "forward": True, "blocked": False, "follows_boundary": False, "simulated": 0}
    found.__dict__.update(own, _place=Place(BEGIN, [Swum(BEGIN[None])]), _jacobian=SLOPES, _refused=False)
    return found


def followed(descent: Descent) -> np.ndarray:
    for number in range(ROUNDS):
        descent._round, descent._residual = number, SLOPES @ (BEST - descent.at)
        descent._place = descent._take_step(descent._whitened_by(np.eye(len(SLOPES))))
    return descent.at


def test_a_descent_stops_at_the_boundary_unless_it_follows_it_to_the_optimum(
    descent: Descent,
) -> None:
    inside = {"type": "ineq", "fun": lambda point: margin(point[None])[0]}
    optimum = minimize(misfit, BEGIN, constraints=[inside]).x
    stopped = followed(descent)
    assert margin(stopped[None])[0] > 0
    assert misfit(stopped) > misfit(optimum) + 10
    assert descent._refused

    descent.follows_boundary = True
    reached = followed(descent)
    assert margin(reached[None])[0] > 0
    assert misfit(reached) < misfit(optimum) + 0.5


@pytest.mark.parametrize(("gain", "converged"), [(0.003, True), (-0.2, True), (3.0, False)])
def test_a_descent_that_goes_to_and_fro_between_places_as_likely_has_converged(
    descent: Descent, monkeypatch: pytest.MonkeyPatch, gain: float, converged: bool
) -> None:
    descent._converged, descent._round, descent.log_density = False, 0, 5.0
    monkeypatch.setattr(descent, "run_on", lambda _: setattr(descent, "log_density", 5.0 + gain))
    descent.settle(0.5)
    assert descent.done is converged
