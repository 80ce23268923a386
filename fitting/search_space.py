"""The space the coefficients are searched in: their square roots, with a crank phase a trial.

Marker distances change by factors of a coefficient rather than by amounts, so the published box [0, 10]^5 is
searched in square roots: small coefficients are resolved, zero is still reached.
"""

from typing import NamedTuple

import numpy as np
from scipy.stats import qmc

from fitting.forecast import phase_from_harmonic
from fitting.from_rest import seconds_from_rest, swims_forward
from fitting.objective import COEFFICIENT_BOUNDS, Swims
from swimmer import PUBLISHED_COEFFICIENTS

# Steps of the differences. Trajectories are smooth in the large, but Kutta lift switches its side within a fraction
# of a degree where a thin plate moves edge-on, which roughens them by some 0.05 mm: small steps would measure that.
ROOT_STEP = 0.08
PHASE_STEP_RAD = 0.03
FREE_TURNS_RAD = 100.0  # phases are free; the optimiser asks for finite bounds
ROOTS = np.sqrt(COEFFICIENT_BOUNDS)


class Screened(NamedTuple):
    """Points (p, s) of the box in step with the trials, and their softened mean distances (s,), m."""

    points: np.ndarray
    objective_m: np.ndarray


class SearchSpace:
    """The objective of a set of swims over roots of coefficients and phases; counts what it simulates.

    Points are columns (p, s): five roots, then a phase (rad) for each of the t trials.

    Attributes:
        evaluations: points simulated so far.
        spent_s: seconds simulated so far, the checks from rest included.
    """

    def __init__(self, swims: Swims) -> None:
        self.swims = swims
        self.norm = swims.norm
        self.evaluations, self.spent_s = 0, 0.0
        self._seconds = sum(float(trial.time_s[trial.scored][-1]) for trial in swims.trials)
        self._seconds_from_rest = seconds_from_rest(swims.trials)
        free = np.full(len(swims.trials), FREE_TURNS_RAD)
        self.low = np.append(np.full(5, ROOTS[0]), -free)
        self.high = np.append(np.full(5, ROOTS[1]), free)

    @property
    def size(self) -> int:
        """p, the number of parameters."""
        return len(self.low)

    def errors(self, points: np.ndarray) -> np.ndarray:
        """(2 e, s) marker errors of points (p,) or (p, s), m."""
        columns = points.reshape(self.size, -1)
        self.count(columns.shape[1])
        return self.swims.errors(parameters(columns))

    def slopes(self, x: np.ndarray, _errors: np.ndarray) -> np.ndarray:
        """(2 e, p) central differences of the errors at x (p, 1), one-sided at a bound, all in one batch."""
        step = self._steps()
        above, below = np.minimum(x + step, self.high[:, None]), np.maximum(x - step, self.low[:, None])
        up, down = np.split(self.errors(np.hstack([above, below])), 2, axis=1)
        return self._by_parameter((up - down) / (above - below).max(axis=0))

    def slopes_ahead(self, x: np.ndarray, errors: np.ndarray) -> np.ndarray:
        """(2 e, p) one-sided differences, away from the nearer bound: half the price, good enough far from the end."""
        step = self._steps()
        step = np.where(x + step > self.high[:, None], -step, step)
        return self._by_parameter((self.errors(x + step) - errors) / _signed(step))

    def _steps(self) -> np.ndarray:
        """(p, 6) steps of the differences: a coefficient in each column, and all phases together in the last."""
        steps = np.zeros((self.size, 6))
        steps[:5, :5], steps[5:, 5] = np.diag(np.full(5, ROOT_STEP)), PHASE_STEP_RAD
        return steps

    def _by_parameter(self, slopes: np.ndarray) -> np.ndarray:
        """(2 e, p) slopes of (2 e, 6): a phase moves the errors of its own trial alone."""
        samples = [2 * int((trial.weight[trial.scored] > 0).sum()) for trial in self.swims.trials]
        own = np.repeat(np.eye(len(samples)), samples, axis=0)  # (2 e, t)
        return np.hstack([slopes[:, :5], slopes[:, 5:] * own])

    def objectives(self, points: np.ndarray) -> np.ndarray:
        """(s,) softened mean distance of points (p, s), m."""
        return np.array([self.norm.value(column[:, None]) for column in self.errors(points).T])

    def phases_in_step(self, coefficients: np.ndarray) -> np.ndarray:
        """(t, s) crank phases that bring the tail in step with each trial, of sets of coefficients (s, 5), rad."""
        self.count(len(coefficients))
        trials = self.swims.trials
        return np.array([phase_from_harmonic(self.swims.twin, t, coefficients, t.frequency.hz) for t in trials])

    def screened(self, count: int, random: np.random.Generator) -> Screened:
        """The published coefficients, and as many points of the whole box."""
        roots = ROOTS[0] + np.ptp(ROOTS) * qmc.Sobol(5, rng=random).random(count)
        coefficients = np.vstack([PUBLISHED_COEFFICIENTS, roots**2])
        points = np.vstack([np.sqrt(coefficients).T, self.phases_in_step(coefficients)])
        return Screened(points, self.objectives(points))

    def promising(self, points: np.ndarray, wanted: int, apart: float) -> list[np.ndarray]:
        """(p,) at most as many points as wanted to begin at; backward swimmers only where too few swim forward.

        Args:
            points: (p, s) best first.
            wanted: how many.
            apart: distance that any two keep at least, in roots of the coefficients.
        """
        chosen: list[np.ndarray] = []
        backward: list[np.ndarray] = []

        def choose(point: np.ndarray) -> None:
            if len(chosen) < wanted and all(np.linalg.norm(point[:5] - other[:5]) > apart for other in chosen):
                chosen.append(point)

        for some in np.array_split(points, range(wanted, points.shape[1], wanted), axis=1):
            if len(chosen) == wanted:
                break
            for point, forward in zip(some.T, self.swims_forward(some), strict=True):
                if forward:
                    choose(point)
                else:
                    backward.append(point)
        for point in backward:
            choose(point)
        return chosen

    def swims_forward(self, points: np.ndarray) -> np.ndarray:
        """(s,) whether the twin of each point (p, s) swims forward from rest."""
        return self.go_forward(parameters(points)[:5].T)

    def go_forward(self, coefficients: np.ndarray) -> np.ndarray:
        """(s,) the same of sets of coefficients (s, 5)."""
        self.spent_s += self._seconds_from_rest * len(coefficients)
        return swims_forward(self.swims.twin, coefficients, self.swims.trials)

    def count(self, points: int) -> None:
        """Notes that so many points were simulated."""
        self.evaluations += points
        self.spent_s += self._seconds * points


def _signed(step: np.ndarray) -> np.ndarray:
    """(6,) how far each column of steps (p, 6) goes."""
    return step[np.abs(step).argmax(axis=0), np.arange(step.shape[1])]


def parameters(points: np.ndarray) -> np.ndarray:
    """(p, ...) coefficients and phases of points (p, ...)."""
    result = np.array(points, float)
    result[:5] = np.clip(result[:5] ** 2, *COEFFICIENT_BOUNDS)  # the square of a bound's root may lie just beyond it
    return result
