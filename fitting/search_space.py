"""The space the coefficients are searched in: their square roots, with a crank phase a trial.

Marker distances change by factors of a coefficient rather than by amounts, so the published box [0, 10]^5 is
searched in square roots: small coefficients are resolved, zero is still reached.
"""

import numpy as np

from fitting.from_rest import seconds_from_rest, swims_forward
from fitting.objective import COEFFICIENT_BOUNDS, Swims
from fitting.phase import phase_from_harmonic

# Steps of the differences. Trajectories are smooth in the large, but Kutta lift switches its side within a fraction
# of a degree where a thin plate moves edge-on, which roughens them by some 0.05 mm: small steps would measure that.
ROOT_STEP = 0.08
PHASE_STEP_RAD = 0.03
FREE_TURNS_RAD = 100.0  # phases are free; the optimiser asks for finite bounds
ROOTS = np.sqrt(COEFFICIENT_BOUNDS)


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
        self._count(columns.shape[1])
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

    def in_step(self, coefficients: np.ndarray) -> np.ndarray:
        """(p, s) points: sets of coefficients (s, 5), each with the crank phases that bring the tail in step."""
        twin, trials = self.swims.twin, self.swims.trials
        self._count(len(coefficients))
        phases = [phase_from_harmonic(twin, trial, coefficients, trial.frequency.hz) for trial in trials]
        return np.vstack([np.sqrt(coefficients).T, phases])

    def swims_forward(self, points: np.ndarray) -> np.ndarray:
        """(s,) whether the twin of each point (p, s) swims forward from rest."""
        self.spent_s += self._seconds_from_rest * points.shape[1]
        return swims_forward(self.swims.twin, parameters(points)[:5].T, self.swims.trials)

    def _count(self, points: int) -> None:
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
