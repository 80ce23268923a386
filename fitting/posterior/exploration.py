"""Where the posterior lies, and an emulator that holds there: simulations are added where they are needed.

A Sobol sequence over the whole prior box comes first, so that no start decides which valley is found. Then the twin is
simulated at draws from the posterior by the emulator so far, half of them moved outward, and the emulator is made anew,
until it predicts fresh draws. What it misses counts as an error of the model, so that early rounds look widely.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from fitting.objective import COEFFICIENT_BOUNDS
from fitting.posterior.box_size import BOX_SD_M, box_size
from fitting.posterior.emulator import Emulator, fit_emulator
from fitting.posterior.ensemble import LOG_MOST, WALKERS, log_posterior, sampler
from fitting.posterior.likelihood import Likelihood
from fitting.posterior.session_model import Disturbances, SessionModel
from fitting.posterior.step_shift import StepShift

_WORLDWIDE, _ROUND, _STEPS = 256, 64, 400
_ROUNDS = (3, 40)  # fewest, most
_OUTWARD, _ONWARD, _JITTER = 1.7, 3.0, 0.02  # _ONWARD: of the last move, at most
_HALVED, _HALVED_ROUNDS = 8, 6  # points of a round simulated with half the step; rounds that count
_FINALLY_HALVED, _FINALLY_LOOKED = 128, 8  # draws at the end with half the step; looks there at nuisances
_FEWEST_HALVED = 12
_LATER = 8  # looks that count
_LOOKED = 8  # points of a round at most at which nuisances are looked at until none of their twins diverges
_NEIGHBOURS, _FALL_OFF = 90, 60.0  # points that count in full for the next emulator; how fast others count less
_LEAST_LOOKING = 1e-3  # discrepancy while the posterior is looked for: with less, walkers stay where first guesses were
_GOOD_ENOUGH = 0.5  # standard deviation of emulated minus simulated ln likelihood
_STABLE_SD = 0.25  # by which means may still move from round to round, in standard deviations

Tell = Callable[[str, float | None], None]


@dataclass(frozen=True, eq=False)
class Exploration:
    """What the search for the posterior found.

    Attributes:
        likelihood: by the emulator, with all that disturbs it.
        walkers: (w, 7) draws from the posterior to start from: coefficients, then ln discrepancy of wave and speed.
        simulations: of each trial.
        box_sd_m: of a box from its marker, each way.
        disturbances: of the row of gaits.
        step_shift: what a vanishing time step adds to simulated gaits; the likelihood is of gaits with it.
        emulator_error: standard deviation of emulated minus simulated ln likelihood at fresh draws.
        settled: whether the rounds ended because the emulator held.
    """

    likelihood: Likelihood
    walkers: np.ndarray
    simulations: int
    box_sd_m: float
    disturbances: Disturbances
    step_shift: StepShift
    emulator_error: float
    settled: bool


def explore(
    model: SessionModel, start: np.ndarray | None = None, seed: int = 0, tell: Tell | None = None
) -> Exploration:
    """Finds the posterior.

    Args:
        model: the trials.
        start: (s, 5) coefficients to look at as well, such as those of a fit.
        seed: of all draws.
        tell: of the progress.
    """
    search = _Search(model, np.random.default_rng([seed, 1]))
    search.simulate(_worldwide(seed) if start is None else np.vstack([_worldwide(seed), start]))
    for number in range(_ROUNDS[1]):
        if tell is not None:
            tell(f"looking for the posterior, round {number + 1}", number / _ROUNDS[1])
        likelihood = search.likelihood()
        if search.round(likelihood) and number >= _ROUNDS[0]:
            return search.result(True)
    return search.result(False)


class _Search:
    """Simulations so far, and the emulator they make."""

    def __init__(self, model: SessionModel, random: np.random.Generator) -> None:
        self.model, self.random = model, random
        k = len(model.measured)
        self.points, self.gaits = np.zeros((0, 5)), np.zeros((0, k))
        self.at_half_steps: list[
            tuple[np.ndarray, np.ndarray, np.ndarray]
        ] = []  # points, gaits by whole and half steps
        self.step_shift = StepShift.none(k)
        self.relevance = np.zeros(0)
        self.looks: list[Disturbances] = []  # at one draw of each round
        self.box_sd_m = BOX_SD_M
        self.walkers: np.ndarray | None = None
        self.mean: np.ndarray | None = None  # (5,) of the last round
        self.error = np.inf

    def simulate(self, points: np.ndarray) -> np.ndarray:
        """(s,) whether each point (s, 5) could be simulated; those that could are kept."""
        gaits = self.model.simulated(points)
        good = np.isfinite(gaits).all(axis=1)
        self.points, self.gaits = np.vstack([self.points, points[good]]), np.vstack([self.gaits, gaits[good]])
        self.relevance = np.append(self.relevance, np.ones(int(good.sum())))
        return good

    @property
    def shifted(self) -> np.ndarray:
        """(s, k) the gaits so far, as if the time step had vanished."""
        return self.gaits + self.step_shift(self.points)

    @property
    def disturbances(self) -> Disturbances:
        """The mean of the later looks."""
        return Disturbances.mean(self.looks[-_LATER:])

    def likelihood(self) -> Likelihood:
        """By an emulator of all simulations so far."""
        whole = fit_emulator(self.points, self.gaits, self.relevance)
        self.step_shift = self._step_shift(whole)
        emulator = whole.moved(self.step_shift.weights)
        disturbances = self.disturbances.of(self.box_sd_m) if self.looks else self.model.noise
        return Likelihood(
            self.model.measured, disturbances + emulator.error + self.step_shift.error, self.model.discrepancy, emulator
        )

    def round(self, likelihood: Likelihood) -> bool:
        """One more look by a likelihood; whether its emulator held."""
        chain = self._sampled(likelihood)
        count = min(_ROUND * (1 + len(self.points) // 1000), 4 * _ROUND)
        drawn = chain[self.random.choice(len(chain), count, replace=False)]
        half = count // 2
        points = drawn[:, :5].copy()
        points[half:] = self._ahead(points[half:], chain[:, :5].mean(axis=0))
        before = len(self.gaits)
        good = self.simulate(points)[:half]
        fresh = self.shifted[before : before + int(good.sum())]
        discrepancy = np.exp(drawn[:half, 5:][good])
        told = likelihood(points[:half][good], discrepancy)
        missed = (likelihood.of_gaits(fresh, discrepancy) - told)[np.isfinite(told)]
        self.error = float(missed.std()) if len(missed) > 1 else np.inf
        middle, spread = chain[:, :5].mean(axis=0), chain[:, :5].std(axis=0)
        moved = np.full(5, np.inf) if self.mean is None else np.abs(middle - self.mean) / spread
        self.mean = middle
        self._halve(slice(before, before + min(_HALVED, int(good.sum()))))
        self._look(drawn[:half, :5][good])
        left = self.model.measured - likelihood.emulator(middle[None])[0]
        if self.looks:
            self.box_sd_m = box_size(left, len(self.model.trials), self.disturbances)
        self._weigh(likelihood, np.exp(np.median(chain[:, 5:], axis=0)))
        return self.error < _GOOD_ENOUGH and float(moved.max()) < _STABLE_SD

    def result(self, settled: bool) -> Exploration:
        """By all simulations, and by a closer look at nuisances and step where the search ended."""
        likelihood = self.likelihood()
        drawn = self._sampled(likelihood)
        points = drawn[self.random.choice(len(drawn), _FINALLY_HALVED, replace=False), :5]
        before = len(self.gaits)
        self.simulate(points)
        self._halve(slice(before, len(self.gaits)))
        earlier, self.looks = self.looks, []
        for few in np.array_split(self.points[before:], _FINALLY_LOOKED):
            self._look(few)
        self.looks = self.looks or earlier
        likelihood = self.likelihood()
        return Exploration(
            likelihood=likelihood,
            walkers=self._placed(likelihood),
            simulations=len(self.points),
            box_sd_m=self.box_sd_m,
            disturbances=self.disturbances,
            step_shift=self.step_shift,
            emulator_error=self.error,
            settled=settled,
        )

    def _sampled(self, likelihood: Likelihood) -> np.ndarray:
        """(d, 7) draws by the emulator, from where the last walkers stood."""
        ensemble = sampler(likelihood, least_discrepancy=_LEAST_LOOKING)
        ensemble.random_state = np.random.RandomState(int(self.random.integers(2**31))).get_state()
        ensemble.run_mcmc(self._placed(likelihood), _STEPS, skip_initial_state_check=True)
        self.walkers = ensemble.get_last_sample().coords
        return ensemble.get_chain(discard=_STEPS // 2, flat=True)

    def _placed(self, likelihood: Likelihood) -> np.ndarray:
        """(w, 7) the walkers, those that stand where nothing is known put elsewhere."""
        walkers = self._best(likelihood, WALKERS) if self.walkers is None else self.walkers.copy()
        value = log_posterior(likelihood, _LEAST_LOOKING)
        lost = ~np.isfinite(value(walkers))
        walkers[lost] = self._best(likelihood, int(lost.sum()))
        lost = ~np.isfinite(value(walkers))
        if 0 < lost.sum() < WALKERS:  # copies part at their first moves
            walkers[lost] = walkers[self.random.choice(np.flatnonzero(~lost), int(lost.sum()))]
        return walkers

    def _best(self, likelihood: Likelihood, count: int) -> np.ndarray:
        """(c, 7) near the simulated points that were most like what was measured."""
        like = likelihood.of_gaits(self.shifted, np.full((len(self.gaits), 2), 0.3))
        first = self.points[np.argsort(-like)[:WALKERS]][self.random.permutation(WALKERS)[:count]]
        near = _reflected(first * (1 + _JITTER * self.random.standard_normal(first.shape)))
        return np.column_stack([near, LOG_MOST - self.random.uniform(1.0, 3.0, (count, 2))])

    def _halve(self, rows: slice) -> None:
        """Simulates some points with half the time step too."""
        halved = self.model.at_half_steps.simulated(self.points[rows])
        good = np.isfinite(halved).all(axis=1)
        self.at_half_steps.append((self.points[rows][good], self.gaits[rows][good], halved[good]))

    def _step_shift(self, emulator: Emulator) -> StepShift:
        """From points of the last rounds; a good emulator of whole steps smooths their roughness away."""
        last = self.at_half_steps[-_HALVED_ROUNDS:]
        if sum(len(points) for points, *_ in last) < _FEWEST_HALVED:
            return StepShift.none(len(self.model.measured))
        points, whole, halved = map(np.concatenate, zip(*last, strict=True))
        shifts = (StepShift.fitted(points, by, halved) for by in (whole, emulator(points)))
        return min(shifts, key=lambda shift: float(np.trace(shift.error)))

    def _ahead(self, points: np.ndarray, middle: np.ndarray) -> np.ndarray:
        """(s, 5) draws moved outward from their middle, and on in the direction in which that has moved."""
        moved = np.zeros(5) if self.mean is None else middle - self.mean
        onward = self.random.uniform(0.0, _ONWARD, (len(points), 1))
        return _reflected(middle + _OUTWARD * (points - middle) + onward * moved)

    def _look(self, points: np.ndarray) -> None:
        """At the first of some points (s, 5) where none of the twins that differ from this one diverges."""
        for point in points[:_LOOKED]:
            look = self.model.disturbances(point)
            if look.finite:
                self.looks.append(look)
                return

    def _weigh(self, likelihood: Likelihood, discrepancy: np.ndarray) -> None:
        """The less a point's gait is like the measured one, the less it counts."""
        misfit = -2 * likelihood.of_gaits(self.shifted, np.tile(discrepancy, (len(self.gaits), 1)))
        near = np.partition(misfit, min(_NEIGHBOURS, len(misfit) - 1))[min(_NEIGHBOURS, len(misfit) - 1)]
        self.relevance = np.maximum(np.exp(-np.maximum(misfit - near, 0.0) / _FALL_OFF), 1e-6)


def _worldwide(seed: int) -> np.ndarray:
    """(s, 5) over the whole box, even in the roots."""
    return COEFFICIENT_BOUNDS[1] * qmc.Sobol(5, seed=seed).random(_WORLDWIDE) ** 2


def _reflected(points: np.ndarray) -> np.ndarray:
    low, high = COEFFICIENT_BOUNDS
    points = low + np.abs(points - low)
    return np.clip(high - np.abs(high - points), low, high)
