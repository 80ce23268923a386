"""The published objective and search, for comparison.

"Simple Models, Real Swimming" (2026) finds its five coefficients so (`published_search`): Bayesian optimisation of the
coefficients, then Nelder-Mead with the crank phase of each trial, on the mean marker distance in the head frame after
warm-up, over all fit trials jointly. Each trial's crank makes its measured turn, or turns evenly at the measured
frequency. The proposals of the Bayesian optimisation come in batches (constant liar) so that all cores are used; its
Gaussian process runs on one BLAS thread, which is several times faster at this size. A point counts as a new best only
if its twin swims forward from rest (see `fitting.phase`).
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import nlopt
import numpy as np
from scipy.stats import qmc
from threadpoolctl import threadpool_limits

from fitting.phase import BEATS, phase_from_harmonic, probed_hz, residuals, swims_forward
from fitting.trial import MeasuredTrial
from swimcal.errors import SimulationDiverged
from swimcal.mjcf import COEFFICIENT_BOUNDS, FluidCoefficients
from swimcal.runs import Runs
from swimcal.twin import Twin, simulate_together
from tracking.head_frame import HeadFrame

LOST_M = 1.0  # distance that a diverged simulation counts with
Progress = Callable[[float, float], None]
_INITIAL = 16  # Sobol points before the first proposal
_BATCH = 4  # proposals in a batch
_BAYESIAN_SHARE = 0.3  # share of the budget for Bayesian optimisation; the rest is Nelder-Mead's
_SIMPLEX = (1.0, 0.1)  # first steps of the simplex, in coefficients and in phases (rad)
_FREE_TURNS_RAD = 100.0  # phases are free; the optimiser asks for finite bounds
_PENALTY = 1.5  # factor on the distance of what swims backward


@dataclass(frozen=True, eq=False)
class Swims:
    """The trials with which a set of parameters is compared, and the twin that swims them."""

    twin: Twin
    trials: tuple[MeasuredTrial, ...]

    def simulate(self, parameters: np.ndarray) -> list[HeadFrame]:
        """Simulate head frames (s, k, m, 2) of each trial for s columns of parameters (p, s); what diverges is nan.

        All trials run in one batch, each until the last of its k frames that is scored, or to the next with a head,
        from which a gap before it is bridged.
        """
        coefficients, count = parameters[:5].T, parameters.shape[1]
        frames = []
        for t in self.trials:
            last = int(np.flatnonzero(t.scored)[-1])
            later = last + np.flatnonzero(t.head_seen[last:])
            frames.append(int(later[0] if len(later) else last) + 1)
        runs = [
            Runs(
                coefficients=coefficients,
                frequency_hz=np.full(count, t.frequency.hz),
                phase_rad=phase_rad,
                velocity=np.tile(t.start_velocity, (count, 1)),
                turns=(t.turn,) * count,
            )
            for t, phase_rad in zip(self.trials, parameters[5:], strict=True)
        ]
        times = [t.time_s[:n] for t, n in zip(self.trials, frames, strict=True)]
        swum = simulate_together([self.twin] * len(runs), runs, times)
        return [trial.seen_head(each.marker_m) for trial, each in zip(self.trials, swum, strict=True)]

    def mean_distance(self, parameters: np.ndarray) -> np.ndarray:
        """Return the mean over trials of the mean distance (s,), m.

        Args:
            parameters: (p, s) coefficients, then a phase for each trial (rad).
        """
        total = np.zeros(parameters.shape[1])
        for trial, head in zip(self.trials, self.simulate(parameters), strict=True):
            distance = np.linalg.norm(residuals(trial, head, trial.scored), axis=-1)  # (s, k, m)
            good = trial.own_weight[trial.scored] > 0
            total += np.nan_to_num(distance[:, good], nan=LOST_M).mean(axis=1)
        return total / len(self.trials)


@dataclass(frozen=True, eq=False)
class PublishedFit:
    """Result of the published search.

    Attributes:
        coefficients: the best that swim forward from rest.
        phase_rad: (t,) crank phase of each fit trial at its time 0.
        mean_distance_m: the objective there, m.
        converged: the simplex became small before the budget was spent.
        simulations: how often the fit trials were simulated.
        seconds: wall time of the search.
    """

    coefficients: FluidCoefficients
    phase_rad: np.ndarray
    mean_distance_m: float
    converged: bool
    simulations: int
    seconds: float


def published_search(
    swims: Swims, budget_s: float, seed: int = 0, progress: Progress = lambda _share, _best_m: None
) -> PublishedFit:
    """Run the published search; the order of the trials does not matter.

    Args:
        swims: the fit trials and the twin.
        budget_s: simulated seconds.
        seed: seed of every random draw.
        progress: called with the share done, 0 to 1, and the best mean distance so far, m.

    Raises:
        SimulationDiverged: no point that swims forward was found within the budget.
    """
    began = time.perf_counter()
    order = np.argsort([trial.name for trial in swims.trials], kind="stable")  # draws go by a trial's place
    search = _Search(Swims(swims.twin, tuple(swims.trials[i] for i in order)), budget_s, progress)
    search.bayesian(_BAYESIAN_SHARE * budget_s, seed)
    converged = search.nelder_mead()
    if not np.isfinite(search.best_m):
        raise SimulationDiverged(
            f"Bayesian optimisation, then Nelder-Mead: none of {search.simulations} points within {budget_s:g} "
            "simulated seconds swims forward from rest; take the recommended fit, or a larger effort"
        )
    return PublishedFit(
        coefficients=FluidCoefficients(*map(float, search.best[:5])),
        phase_rad=search.best[5:][np.argsort(order)],
        mean_distance_m=search.best_m,
        converged=converged,
        simulations=search.simulations,
        seconds=time.perf_counter() - began,
    )


class _Search:
    """The objective over coefficients and phases, what it has cost, and the best so far."""

    def __init__(self, swims: Swims, budget_s: float, progress: Progress) -> None:
        self.simulations, self.spent_s = 0, 0.0
        self.best_m, self.best = np.inf, np.zeros(5 + len(swims.trials))
        self._swims, self._budget_s, self._progress = swims, budget_s, progress
        self._seconds = sum(float(trial.time_s[trial.scored][-1]) for trial in swims.trials)
        self._seconds_from_rest = BEATS / probed_hz(swims.trials)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Return the distances (s,) of points (p, s), m; a point that would be best but swims backward is penalised."""
        distances = self._swims.mean_distance(points)
        self.simulations += points.shape[1]
        self.spent_s += self._seconds * points.shape[1]
        result = distances.copy()
        for i in np.argsort(distances):
            if distances[i] >= self.best_m:
                break
            self.spent_s += self._seconds_from_rest
            if swims_forward(self._swims.twin, points[:5, i][None], self._swims.trials)[0]:
                self.best_m, self.best = float(distances[i]), points[:, i].copy()
                break
            result[i] *= _PENALTY
        self._progress(min(self.spent_s / self._budget_s, 1.0), self.best_m)
        return result

    def bayesian(self, budget_s: float, seed: int) -> None:
        """Spend a budget of simulated seconds on Bayesian optimisation over the five coefficients."""
        from bayes_opt import BayesianOptimization, acquisition  # half a second that nothing else needs

        low, high = COEFFICIENT_BOUNDS
        names = [f"c{i}" for i in range(5)]
        liar = acquisition.ConstantLiar(acquisition.ExpectedImprovement(xi=5e-4))
        search = BayesianOptimization(
            None, dict.fromkeys(names, (low, high)), acquisition_function=liar, random_state=seed, verbose=0
        )

        def evaluate(coefficients: np.ndarray) -> None:
            distances = self(self._in_step(coefficients))
            for values, distance in zip(coefficients, distances, strict=True):
                search.register(dict(zip(names, values, strict=True)), -float(distance))

        with threadpool_limits(1):
            evaluate(low + (high - low) * qmc.Sobol(5, rng=np.random.default_rng(seed)).random(_INITIAL))
            while self.spent_s < budget_s:
                proposals = [search.suggest() for _ in range(_BATCH)]
                evaluate(np.array([[float(p[name]) for name in names] for p in proposals]))

    def nelder_mead(self) -> bool:
        """Spend the rest of the budget on bounded Nelder-Mead (nlopt) from the best; return whether it converged."""
        start, free = self.best, np.full(len(self.best) - 5, _FREE_TURNS_RAD)
        low, high = (
            np.append(np.full(5, end), sign * free) for end, sign in zip(COEFFICIENT_BOUNDS, (-1, 1), strict=True)
        )
        optimiser = nlopt.opt(nlopt.LN_NELDERMEAD, len(start))
        optimiser.set_lower_bounds(low)
        optimiser.set_upper_bounds(high)
        steps = np.append(np.full(5, _SIMPLEX[0]), np.full(len(free), _SIMPLEX[1]))
        steps[start + steps > high] *= -1
        optimiser.set_initial_step(steps)
        optimiser.set_xtol_rel(1e-5)

        def value(place: np.ndarray, _gradient: np.ndarray) -> float:
            if self.spent_s >= self._budget_s:
                raise nlopt.ForcedStop
            return float(self(place[:, None])[0])

        optimiser.set_min_objective(value)
        try:
            optimiser.optimize(np.clip(start, low, high))
        except nlopt.ForcedStop:
            return False
        return bool(optimiser.last_optimize_result() == nlopt.XTOL_REACHED)

    def _in_step(self, coefficients: np.ndarray) -> np.ndarray:
        """Return points (p, s) of coefficients (s, 5), with the crank phases that bring the tail in step."""
        self.simulations += len(coefficients)
        self.spent_s += self._seconds * len(coefficients)
        twin = self._swims.twin
        phases = [phase_from_harmonic(twin, t, coefficients, t.frequency.hz) for t in self._swims.trials]
        return np.vstack([coefficients.T, *phases])
