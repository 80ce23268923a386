"""Where the posterior lies, and an emulator that holds there: simulations are added where they are needed.

A Sobol sequence over the whole prior box comes first, so that no start decides which valley is found. Then the twin is
simulated at draws from the posterior by the emulator so far, half of them moved outward, and the emulator is made anew,
until it predicts fresh draws. What it misses counts as an error of the model, so that early rounds look widely.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from fitting.model.session_model import Disturbances, PlacesOff, SessionModel
from fitting.objective import COEFFICIENT_BOUNDS
from fitting.posterior.emulator import Emulator, fit_emulator
from fitting.posterior.ensemble import LOG_MOST, WALKERS, log_posterior, sampler
from fitting.posterior.likelihood import Likelihood
from fitting.posterior.places_off import places_off
from fitting.posterior.search_state import Halved, SearchState
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
_APART = 1e-6  # relative, by which copies of walkers differ: a snooker move from one to its double is undefined
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
        off: how far boxes and markers are off.
        disturbances: of the row of gaits.
        step_shift: what a vanishing time step adds to simulated gaits; the likelihood is of gaits with it.
        emulator_error: standard deviation of emulated minus simulated ln likelihood at fresh draws.
        settled: whether the rounds ended because the emulator held.
    """

    likelihood: Likelihood
    walkers: np.ndarray
    simulations: int
    off: PlacesOff
    disturbances: Disturbances
    step_shift: StepShift
    emulator_error: float
    settled: bool


def explore(
    model: SessionModel,
    start: np.ndarray | None = None,
    seed: int = 0,
    tell: Tell | None = None,
    backend: Path | None = None,
) -> Exploration:
    """Finds the posterior.

    Args:
        model: the trials.
        start: (s, 5) coefficients to look at as well, such as those of a fit.
        seed: of all draws.
        tell: of the progress.
        backend: a file that keeps how far every round came; the search goes on from it.
    """
    state = None if backend is None else SearchState.load(backend)
    search = _Search(model, state or SearchState.beginning(np.random.default_rng([seed, 1]), len(model.measured)))
    if state is None:
        search.simulate(_worldwide(seed) if start is None else np.vstack([_worldwide(seed), start]))
    while not search.state.looked_closer:
        done = search.state.rounds
        found = search.state.settled or done >= _ROUNDS[1]
        if tell is not None:
            what = "looking closer at" if found else f"round {done + 1} of looking for"
            tell(f"{what} the posterior", done / _ROUNDS[1])
        if found:
            search.look_closer()
        else:
            search.round()
        if backend is not None:
            search.state.save(backend)
    return search.result()


class _Search:
    """Goes on from what is known so far."""

    def __init__(self, model: SessionModel, state: SearchState) -> None:
        self.model, self.state = model, state
        self.step_shift = StepShift.none(len(model.measured))

    def simulate(self, points: np.ndarray) -> np.ndarray:
        """(s,) whether each point (s, 5) could be simulated; those that could are kept."""
        state, gaits = self.state, self.model.simulated(points)
        good = np.isfinite(gaits).all(axis=1)
        state.points, state.gaits = np.vstack([state.points, points[good]]), np.vstack([state.gaits, gaits[good]])
        state.relevance = np.append(state.relevance, np.ones(int(good.sum())))
        return good

    @property
    def shifted(self) -> np.ndarray:
        """(s, k) the gaits so far, as if the time step had vanished."""
        return self.state.gaits + self.step_shift(self.state.points)

    @property
    def disturbances(self) -> Disturbances:
        """The mean of the later looks."""
        return Disturbances.mean(self.state.looks)

    def likelihood(self) -> Likelihood:
        """By an emulator of all simulations so far."""
        whole = fit_emulator(self.state.points, self.state.gaits, self.state.relevance)
        self.step_shift = self._step_shift(whole)
        emulator = whole.moved(self.step_shift.weights)
        disturbances = self.disturbances.of(self.state.off) if self.state.looks else self.model.noise
        return Likelihood(
            self.model.measured, disturbances + emulator.error + self.step_shift.error, self.model.discrepancy, emulator
        )

    def round(self) -> None:
        """One more look by a likelihood, the last one if its emulator holds."""
        likelihood = self.likelihood()
        chain = self._sampled(likelihood)
        count = min(_ROUND * (1 + len(self.state.points) // 1000), 4 * _ROUND)
        drawn = chain[self.state.random.choice(len(chain), count, replace=False)]
        half = count // 2
        points = drawn[:, :5].copy()
        points[half:] = self._ahead(points[half:], chain[:, :5].mean(axis=0))
        before = len(self.state.gaits)
        good = self.simulate(points)[:half]
        fresh = self.shifted[before : before + int(good.sum())]
        discrepancy = np.exp(drawn[:half, 5:][good])
        told = likelihood(points[:half][good], discrepancy)
        missed = (likelihood.of_gaits(fresh, discrepancy) - told)[np.isfinite(told)]
        self.state.error = float(missed.std()) if len(missed) > 1 else np.inf
        middle, spread = chain[:, :5].mean(axis=0), chain[:, :5].std(axis=0)
        moved = np.abs(middle - self.state.mean) / spread if len(self.state.mean) else np.full(5, np.inf)
        self.state.mean = middle
        self._halve(slice(before, before + min(_HALVED, int(good.sum()))))
        self._look(drawn[:half, :5][good])
        left = self.model.measured - likelihood.emulator(middle[None])[0]
        if self.state.looks:
            self.state.off = places_off(left, len(self.model.trials), self.disturbances)
        self._weigh(likelihood, np.exp(np.median(chain[:, 5:], axis=0)))
        self.state.rounds += 1
        held = self.state.error < _GOOD_ENOUGH and float(moved.max()) < _STABLE_SD
        self.state.settled = held and self.state.rounds > _ROUNDS[0]

    def look_closer(self) -> None:
        """At nuisances and step where the search ended."""
        drawn = self._sampled(self.likelihood())
        points = drawn[self.state.random.choice(len(drawn), _FINALLY_HALVED, replace=False), :5]
        before = len(self.state.gaits)
        self.simulate(points)
        self._halve(slice(before, len(self.state.gaits)))
        earlier, self.state.looks = self.state.looks, []
        for few in np.array_split(self.state.points[before:], _FINALLY_LOOKED):
            self._look(few)
        self.state.looks = self.state.looks or earlier
        self.state.looked_closer = True

    def result(self) -> Exploration:
        """By all simulations."""
        likelihood = self.likelihood()
        return Exploration(
            likelihood=likelihood,
            walkers=self._placed(likelihood),
            simulations=len(self.state.points),
            off=self.state.off,
            disturbances=self.disturbances,
            step_shift=self.step_shift,
            emulator_error=self.state.error,
            settled=self.state.settled,
        )

    def _sampled(self, likelihood: Likelihood) -> np.ndarray:
        """(d, 7) draws by the emulator, from where the last walkers stood."""
        ensemble = sampler(likelihood, least_discrepancy=_LEAST_LOOKING)
        ensemble.random_state = np.random.RandomState(int(self.state.random.integers(2**31))).get_state()
        ensemble.run_mcmc(self._placed(likelihood), _STEPS, skip_initial_state_check=True)
        self.state.walkers = ensemble.get_last_sample().coords
        return ensemble.get_chain(discard=_STEPS // 2, flat=True)

    def _placed(self, likelihood: Likelihood) -> np.ndarray:
        """(w, 7) the walkers, those that stand where nothing is known put elsewhere."""
        walkers = self.state.walkers.copy() if len(self.state.walkers) else self._best(likelihood, WALKERS)
        value = log_posterior(likelihood, _LEAST_LOOKING)
        lost = ~np.isfinite(value(walkers))
        walkers[lost] = self._best(likelihood, int(lost.sum()))
        lost = ~np.isfinite(value(walkers))
        if 0 < lost.sum() < WALKERS:
            copies = walkers[self.state.random.choice(np.flatnonzero(~lost), int(lost.sum()))]
            walkers[lost] = copies * (1 + _APART * self.state.random.standard_normal(copies.shape))
        return walkers

    def _best(self, likelihood: Likelihood, count: int) -> np.ndarray:
        """(c, 7) near the simulated points that were most like what was measured."""
        like = likelihood.of_gaits(self.shifted, np.full((len(self.state.gaits), 2), 0.3))
        first = self.state.points[np.argsort(-like)[:WALKERS]][self.state.random.permutation(WALKERS)[:count]]
        near = _reflected(first * (1 + _JITTER * self.state.random.standard_normal(first.shape)))
        return np.column_stack([near, LOG_MOST - self.state.random.uniform(1.0, 3.0, (count, 2))])

    def _halve(self, rows: slice) -> None:
        """Simulates some points with half the time step too."""
        halved = self.model.at_half_steps.simulated(self.state.points[rows])
        good = np.isfinite(halved).all(axis=1)
        told = Halved(self.state.points[rows][good], self.state.gaits[rows][good], halved[good])
        self.state.halved = [*self.state.halved, told][-_HALVED_ROUNDS:]

    def _step_shift(self, emulator: Emulator) -> StepShift:
        """From points of the last rounds; a good emulator of whole steps smooths their roughness away."""
        last = self.state.halved
        if sum(len(points) for points, *_ in last) < _FEWEST_HALVED:
            return StepShift.none(len(self.model.measured))
        points, whole, halved = map(np.concatenate, zip(*last, strict=True))
        shifts = (StepShift.fitted(points, by, halved) for by in (whole, emulator(points)))
        return min(shifts, key=lambda shift: float(np.trace(shift.error)))

    def _ahead(self, points: np.ndarray, middle: np.ndarray) -> np.ndarray:
        """(s, 5) draws moved outward from their middle, and on in the direction in which that has moved."""
        moved = middle - self.state.mean if len(self.state.mean) else np.zeros(5)
        onward = self.state.random.uniform(0.0, _ONWARD, (len(points), 1))
        return _reflected(middle + _OUTWARD * (points - middle) + onward * moved)

    def _look(self, points: np.ndarray) -> None:
        """At the first of some points (s, 5) where none of the twins that differ from this one diverges."""
        for point in points[:_LOOKED]:
            look = self.model.disturbances(point)
            if look.finite:
                self.state.looks = [*self.state.looks, look][-_LATER:]
                return

    def _weigh(self, likelihood: Likelihood, discrepancy: np.ndarray) -> None:
        """The less a point's gait is like the measured one, the less it counts."""
        misfit = -2 * likelihood.of_gaits(self.shifted, np.tile(discrepancy, (len(self.state.gaits), 1)))
        near = np.partition(misfit, min(_NEIGHBOURS, len(misfit) - 1))[min(_NEIGHBOURS, len(misfit) - 1)]
        self.state.relevance = np.maximum(np.exp(-np.maximum(misfit - near, 0.0) / _FALL_OFF), 1e-6)


def _worldwide(seed: int) -> np.ndarray:
    """(s, 5) over the whole box, even in the roots."""
    return COEFFICIENT_BOUNDS[1] * qmc.Sobol(5, seed=seed).random(_WORLDWIDE) ** 2


def _reflected(points: np.ndarray) -> np.ndarray:
    low, high = COEFFICIENT_BOUNDS
    points = low + np.abs(points - low)
    return np.clip(high - np.abs(high - points), low, high)
