"""Search for the mode of the posterior density.

`find_mode` searches: coefficients by Gauss-Newton, variance components by restricted likelihood. The two take turns.
Each step of the coefficients is that of generalised least squares in the covariance so far, within the bounds (Stark
and Parker 1995, by `scipy.optimize.lsq_linear`), halved until it gains. Many starts, the likeliest of points all over
the box, race against each other; the winner is refined with fine time steps and hops about in what the trials allow,
for the twin is rough.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.optimize import lsq_linear
from scipy.stats import qmc

from fitting.covariance import COEFFICIENT_SD, MEDIANS, Block, Covariance
from fitting.features import SPEED
from fitting.mode import AS_LIKELY, FINER, Mode, SearchEnd, blocks_at, broyden, coefficient_covariance, jacobian_at
from fitting.progress import Progress
from fitting.session_model import SessionModel
from fitting.trial_model import NO_ROLL, ROLL_SD, Roll, trajectories_together
from swimcal.errors import SimulationDiverged
from swimcal.mjcf import COEFFICIENT_BOUNDS, PUBLISHED_COEFFICIENTS
from swimcal.runs import Trajectories

# The search
_SCREENED = 128  # points that are simulated to begin with
_SCREENING = 0.3  # share of the time of a search until its descents begin
_TRIED = 4  # candidates for each start whose twins are simulated from rest
_ROUNDS = 14  # largest number of rounds of a descent
_RACES = ((2, 1.0), (6, 0.5))
"""Rounds after which descents are dropped, and how many for each start then go on."""
_BEGUN = 2  # descents at first, for each start
_STARTS_APART = 0.25  # least distance of two starts in the root of one coefficient, as a share of the box
_HOPS = 2  # hops from the end of the best descent
_HOPPED = 32  # points of each hop
_WIDE = (1.5, 3.0)  # scatter of either half of these points, in standard deviations
_RENEWED = (2, 5)  # rounds in which nuisances are simulated anew at the present coefficients
_COARSE = 2  # fine steps in one step of the twin until a descent is refined, see `fitting.mode.FINER`
_REFINED, _REFINING = 2, 4  # how often nuisances are then simulated anew, and rounds after each time
_SD_OF_MEDIAN = 1.4826  # standard deviation of a normal distribution over its median absolute deviation
_NATURALS = tuple(np.linspace(-0.8, 0.8, 9))  # natural frequencies of the first rolls, see `Roll.natural`
_SHARES = (1.0, 0.5, 0.25, 0.1)  # shares of a step that are tried
_ALONG = 8  # rounds along the boundary of twins that swim forward from rest
_CLEARLY = 0.5  # least gain in log density that is not the twin's roughness
_REACHES = (1.0, 0.3)  # shares of a step and of the coefficients' scatter within which points are drawn
_DRAWN = 64  # points drawn along the boundary
_ASKED = 16  # points of these that are simulated from rest
_LOOKED_AT = 4  # points of these that are simulated in the trials
_STILL = 0.2  # a step shorter than this, in standard deviations of the coefficients, is the last
_SHORT = 1.0  # after a step shorter than this the Jacobian is updated instead of simulated anew


def find_mode(
    model: SessionModel, starts: int = 3, seed: int = 0, tell: Progress = lambda _message, _share: None
) -> Mode:
    """Find the likeliest coefficients of a session's fitted trials.

    Args:
        model: the trials; their features hold the course.
        starts: twice as many descents begin at the likeliest of the screened points, those first whose twins swim
            forward from rest, which stay so; as many as this go on after 2 rounds, half of them after 6.
        seed: seed of the screening.
        tell: takes messages with the share of the work that is done.

    Raises:
        SimulationDiverged: the twin diverged from every start.
    """
    tell("looking for starts of the search", 0.0)
    # Points all over the box, even in the roots; the published coefficients come first.
    box = COEFFICIENT_BOUNDS[1] * qmc.Sobol(5, seed=seed).random_base2(int(np.ceil(np.log2(_SCREENED)))) ** 2
    points = np.vstack([PUBLISHED_COEFFICIENTS, box[: _SCREENED - 1]])
    promising, blocks = _choose_promising(model, points, model.simulated(points), _BEGUN * starts)
    descents = [_Descent(model, start, blocks) for start in promising]
    racing, before, done, expected = descents, 0, 0, _expected_steps(len(descents), starts)
    for rounds, left in (*_RACES, (_ROUNDS, 0.0)):
        for descent in racing:
            tell("fitting the coefficients", _SCREENING + (1 - _SCREENING) * min(done / expected, 0.99))
            descent.run(rounds)
            done += rounds - before
        before = rounds
        racing = sorted(racing, key=_rank_in_race)[: max(int(left * starts), 1)]
    for descent in descents:
        descent.look_back()
    while not (found := sorted(descents, key=_rank))[0].done:
        found[0].run(_ROUNDS)
    found[0] = found[0].refine().hop(seed).follow_boundary().pass_through(seed)
    spent = len(points) + sum(each.simulated for each in found)
    found = [each for each in found if np.isfinite(each.log_density)]
    if not found:
        raise SimulationDiverged("the twin diverged from every start; look into the flags of the fit trials")
    ends = tuple(each.mode.ends[0] for each in found)
    return replace(found[0].mode, ends=ends, simulations=spent)


def _expected_steps(descents: int, starts: int) -> float:
    """Return the expected rounds of all descents.

    Those that go on to the end count half the rounds, as they converge on the way.
    """
    steps, before, racing = 0.0, 0, descents
    for rounds, left in _RACES:
        steps, before, racing = steps + racing * (rounds - before), rounds, max(int(left * starts), 1)
    return steps + racing * (_ROUNDS - before) / 2


class _Descent:
    """A descent from one start, as far as it was told to go.

    Attributes:
        log_density: log density where it is; -inf where the twin diverged on the way.
        promise: log density where the next step would lead, were the twin linear and every step allowed: that of the
            variance components, with the coefficients integrated out.
        spread: (5,) standard deviations of where single steps from points about the end lead; 0 before `hop`.
    """

    def __init__(self, model: SessionModel, start: np.ndarray, blocks: tuple[Block, ...]) -> None:
        self.model, self.start, self.simulated = model, start, 0
        self.forward = bool(model.swim_forward(start[None])[0])
        self._blocks, self._covariance, self._finer = blocks, Covariance.of(blocks), _COARSE
        self.log_density, self.promise, self._round, self._converged = -np.inf, -np.inf, 0, False
        self._at, self._sizes = start, dict(MEDIANS)
        self._trajectories = trajectories_together(model.trials, start[None])
        self._jacobian, self._sloped = np.zeros((0, 5)), False
        self._follows_boundary, self._refused, self._blocked = False, False, False
        self.spread = np.zeros(5)

    @property
    def done(self) -> bool:
        """Return whether further steps change nothing."""
        return self._converged or self._round >= _ROUNDS

    def run(self, rounds: int) -> None:
        """Iterate until so many rounds are done, until convergence, or until the twin diverges."""
        try:
            while self._round < rounds and not self._converged:
                self._step()
            self._look(sloped=True)
        except _Diverged:
            self.log_density, self.promise, self._converged = -np.inf, -np.inf, True

    def hop(self, seed: int) -> "_Descent":
        """Go on from the best of points drawn about the end, if that is likelier; return the likelier descent.

        The twin is rough by some hundredths of a millimetre, so that gradients end in hollows of that depth.
        """
        best, random = self, np.random.default_rng([seed, 37])
        for _ in range(_HOPS if np.isfinite(self.log_density) else 0):
            root, _, columns = best._whiten(best._covariance.at(best._sizes))
            scatter = _scatter(columns)
            wide = np.repeat(_WIDE, _HOPPED // len(_WIDE))[:, None]
            drawn = best._at + wide * random.standard_normal((_HOPPED, 5)) @ scatter
            drawn = np.clip(drawn, *COEFFICIENT_BOUNDS)
            told, rows = best._swim_at(drawn)
            best.spread = best._spread_of_ends(drawn, rows, root, columns)
            there = best._best_of(drawn, told, rows, root)
            self.simulated = best.simulated
            if there is None:
                break
            other = copy(best)
            other._at, other._trajectories = there
            other._jacobian, other._sloped, other._converged = np.zeros((0, 5)), False, False
            other.run(best._round + _RACES[-1][0])
            self.simulated = other.simulated
            if other.log_density <= best.log_density:
                break
            best = other
        return best

    def look_back(self) -> None:
        """Tell anew whether the twin swims forward from rest, if that of the start did not."""
        if not self.forward and np.isfinite(self.log_density):
            self.forward = bool(self.model.swim_forward(self._at[None])[0])

    def pass_through(self, seed: int) -> "_Descent":
        """Go on through twins that swim backward from rest, to likelier ones that do not; return the likelier descent.

        The new one must be clearly likelier. A descent that must swim forward all the way stops in front of such twins.
        Where a free one ends at one of them, it goes on from the likeliest of points about there that swim forward.
        """
        if not (self.forward and self._blocked and np.isfinite(self.log_density)):
            return self
        free = copy(self)
        free.forward, free._follows_boundary, free._converged = False, False, False
        free.run(self._round + _ALONG)
        if free.log_density > self.log_density + _CLEARLY:
            free.look_back()
            if not free.forward:
                free._come_back(seed)
        self.simulated = free.simulated
        return free if free.forward and free.log_density > self.log_density + _CLEARLY else self

    def _come_back(self, seed: int) -> None:
        """Go to the likeliest of points drawn about the present one whose twins swim forward, and on from there."""
        root, _, columns = self._whiten(self._covariance.at(self._sizes))
        scatter = _scatter(columns)
        wide = np.repeat(_WIDE, _DRAWN // len(_WIDE))[:, None]
        drawn = self._at + wide * np.random.default_rng([seed, 41]).standard_normal((_DRAWN, 5)) @ scatter
        drawn = np.clip(drawn, *COEFFICIENT_BOUNDS)
        drawn = drawn[self.model.swim_forward(drawn)]
        if not len(drawn):
            return
        told, residuals = self._swim_at(drawn)
        best = int((solve_triangular(root, residuals.T, lower=True) ** 2).sum(axis=0).argmin())
        self._at = drawn[best]
        self._trajectories = [each.part(np.array([best]), each.time_s.shape[-1]) for each in told]
        self._jacobian, self._sloped, self._converged, self.forward = np.zeros((0, 5)), False, False, True
        self.run(self._round + _ALONG)

    def follow_boundary(self) -> "_Descent":
        """Go on along the boundary of twins that swim forward from rest, and return the likelier descent.

        The new one must be clearly likelier. Steps that cross the boundary are refused. It has no gradient, as beyond
        it a twin settles in another steady state: so points are drawn about part of the step, with the covariance of
        the coefficients, and each is simulated from rest.
        """
        if not (self.forward and np.isfinite(self.log_density)):
            return self
        _, white, columns = self._whiten(self._covariance.at(self._sizes))
        if white @ white - ((white - columns @ self._free_step(white, columns)) ** 2).sum() < 2 * _CLEARLY:
            return self
        other = copy(self)
        other._follows_boundary, other._converged = True, False
        other.run(self._round + _ALONG)
        self.simulated = other.simulated
        return other if other.log_density > self.log_density + _CLEARLY else self

    def _step(self) -> None:
        if self._round in _RENEWED:
            self._renew()
        self._look()
        jacobian = self._jacobian
        others = self._covariance.without_roll(self._sizes) + COEFFICIENT_SD**2 * jacobian @ jacobian.T
        if self._round in (0, *_RENEWED):
            self._start_roll(others)
        rolled = self._roll(others)
        total = self._covariance.at(self._sizes)
        root = np.linalg.cholesky(np.linalg.inv(coefficient_covariance(total, jacobian)))
        before, residual = self._at, self._residual
        self._at, self._trajectories = self._take_step(total)
        length = self._slope_on(before, residual, root)
        still = length is not None and np.hypot(length, rolled) < _STILL
        self._converged = bool(still) and self._round >= _RENEWED[0]
        self._round += 1

    def _renew(self) -> None:
        """Simulate the nuisances anew at the present point, unless a twin next to it diverges."""
        blocks = blocks_at(self.model, self._at, self._finer)
        self.simulated += 14 + self._finer
        if all(map(_is_finite, blocks)):
            self._blocks, self._covariance = blocks, Covariance.of(blocks)

    def refine(self) -> "_Descent":
        """Go on with the error of the time step that fine steps tell, and return this descent.

        Far from the end it would lead astray: it changes with the coefficients, and no step accounts for that.
        """
        if not np.isfinite(self.log_density):
            return self
        self._finer = FINER
        for _ in range(_REFINED):
            self._renew()
            self._converged = False
            self.run(self._round + _REFINING)
        return self

    def _slope_on(self, before: np.ndarray, residual: np.ndarray, root: np.ndarray) -> float | None:
        """Update the Jacobian after a step, and return the step's length; None to try it again.

        Args:
            before: (5,) coefficients where the step began.
            residual: (K,) the residual there.
            root: (5, 5) of the information about the coefficients, by which lengths are measured.
        """
        step, sloped = self._at - before, self._sloped
        length = float(np.linalg.norm(root.T @ step))
        if not step.any():
            if not sloped:
                self._jacobian = self._jacobian[:0]
            return length if sloped else None
        self._sloped = False
        change = residual - self._residual_with(None)
        short = length < _SHORT
        self._jacobian = broyden(self._jacobian, step, change, root @ (root.T @ step)) if short else self._jacobian[:0]
        return length

    def _look(self, sloped: bool = False) -> None:
        """Update residual, Jacobian and likeliest sizes at the present point.

        The Jacobian is simulated if `sloped`, or if it is unknown.
        """
        self._residual = self._residual_with(None)
        if not len(self._jacobian) or (sloped and not self._sloped):
            self._jacobian, self._sloped = jacobian_at(self.model.trials, self._at), True
            self.simulated += 10
        if not (np.isfinite(self._residual).all() and np.isfinite(self._jacobian).all()):
            raise _Diverged
        self._sizes, deviance = self._covariance.restricted(self._residual, self._jacobian, self._sizes)
        _, white, columns = self._whiten(self._covariance.at(self._sizes))
        left = white - columns @ self._free_step(white, columns)
        self.promise = -deviance - self.model.trials[0].roll.deviance
        self.log_density = self.promise - 0.5 * float(white @ white - left @ left)

    def _residual_with(self, roll: Roll | None) -> np.ndarray:
        """Return the residual (K,) at the present point, with another roll of the hull or with its own."""
        trials = self.model.trials if roll is None else self.model.rolling(roll).trials
        rows = [trial.features_of(each)[0] for trial, each in zip(trials, self._trajectories, strict=True)]
        return np.asarray(self.model.measured - np.concatenate(rows))

    @property
    def mode(self) -> Mode:
        """Mode at the present point."""
        end = SearchEnd(self.start, self._at, self.log_density, self._converged, self.forward, self._refused)
        look = self._covariance, self._blocks, self._residual, self._jacobian
        return Mode(self.model, self._at, self._sizes, *look, (end,), self.simulated, self.spread)

    def _start_roll(self, total: np.ndarray) -> None:
        """Begin with the likeliest roll of a few natural frequencies, in a covariance (K, K) of all else.

        Near its natural frequency a roll turns round, so that a wrong one asks for the wrong sign.
        """
        without, factor = self._residual_with(NO_ROLL), cho_factor(total, lower=True)
        found: list[tuple[float, Roll]] = []
        for natural in _NATURALS:
            column = without - self._residual_with(Roll(ROLL_SD[0], natural))
            pull = column @ cho_solve(factor, without)
            information = column @ cho_solve(factor, column) + 1.0
            roll = NO_ROLL.moved(np.array([pull / information, natural / ROLL_SD[1]]))
            found.append((0.5 * pull**2 / information - 0.5 * (natural / ROLL_SD[1]) ** 2, roll))
        self.model = self.model.rolling(max(found)[1])
        self._residual = self._residual_with(None)

    def _roll(self, total: np.ndarray) -> float:
        """Step to the likeliest roll, and return the step in standard deviations.

        The step is linear, in a covariance (K, K) of all else.
        """
        roll, trials = self.model.trials[0].roll, zip(self.model.trials, self._trajectories, strict=True)
        rolls = np.vstack([trial.slopes_of_roll(each) for trial, each in trials])
        factor = cho_factor(total, lower=True)
        information = rolls.T @ cho_solve(factor, rolls) + np.eye(2)
        pull = rolls.T @ cho_solve(factor, self._residual) - np.array(roll) / ROLL_SD
        there = roll.moved(np.linalg.solve(information, pull))
        self.model = self.model.rolling(there)
        self._residual, self._covariance = self._residual_with(None), replace(self._covariance, rolls=rolls)
        step = (np.array(there) - np.array(roll)) / ROLL_SD
        return float(np.sqrt(step @ information @ step))

    def _take_step(self, total: np.ndarray) -> tuple[np.ndarray, list[Trajectories]]:
        """Return the coefficients (5,) one step on and what swims there, or the same where nothing that is tried gains.

        A twin that swims forward from rest keeps doing so.
        """
        root, white, columns = self._whiten(total)
        step, self._refused = self._free_step(white, columns), False
        for shares in (_SHARES[:1], _SHARES[1:]):
            tried = np.clip(self._at + np.outer(shares, step), *COEFFICIENT_BOUNDS)
            if (there := self._best(tried, root)) is not None:
                return there
        for reach in _REACHES if self._follows_boundary else ():
            if (there := self._best(self._draw_ahead(reach, step, white, columns), root)) is not None:
                return there
        return self._at, self._trajectories

    def _whiten(self, total: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the root (K, K) of a covariance, and the residual (K,) and Jacobian (K, 5) whitened by it."""
        root = np.linalg.cholesky(total)
        return root, *(solve_triangular(root, each, lower=True) for each in (self._residual, self._jacobian))

    def _free_step(self, white: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return the least-squares step (5,) within the bounds for a whitened residual (K,) and Jacobian (K, 5)."""
        low, high = COEFFICIENT_BOUNDS
        return np.asarray(lsq_linear(columns, white, bounds=(low - self._at - 1e-9, high - self._at + 1e-9)).x)

    def _best(self, tried: np.ndarray, root: np.ndarray) -> tuple[np.ndarray, list[Trajectories]] | None:
        """Return the point (5,) of (s, 5) with the least whitened residual, and what swims there; None if no gain."""
        return self._best_of(tried, *self._swim_at(tried), root) if len(tried) else None

    def _swim_at(self, tried: np.ndarray) -> tuple[list[Trajectories], np.ndarray]:
        """Return what swims at points (s, 5), in each trial, and the residuals there (s, K)."""
        told = trajectories_together(self.model.trials, tried)
        self.simulated += len(tried)
        rows = np.hstack([trial.features_of(each) for trial, each in zip(self.model.trials, told, strict=True)])
        return told, np.nan_to_num(self.model.measured - rows, nan=1e3)

    def _spread_of_ends(
        self, drawn: np.ndarray, residuals: np.ndarray, root: np.ndarray, columns: np.ndarray
    ) -> np.ndarray:
        """Return how far single steps from points about the end lead apart, as standard deviations (5,).

        Were the twin linear, each would lead to the end itself. The median serves, as some twins near it may settle in
        another steady state.

        Args:
            drawn: (s, 5) the points.
            residuals: (s, K) there.
            root: (K, K) of the covariance.
            columns: (K, 5) whitened Jacobian at the end.
        """
        white = solve_triangular(root, residuals.T, lower=True)
        scatter = _scatter(columns)
        ends = drawn + (scatter.T @ scatter @ (columns.T @ white)).T
        return np.asarray(_SD_OF_MEDIAN * np.median(np.abs(ends - np.median(ends, axis=0)), axis=0))

    def _best_of(
        self, tried: np.ndarray, told: Sequence[Trajectories], residuals: np.ndarray, root: np.ndarray
    ) -> tuple[np.ndarray, list[Trajectories]] | None:
        """Return the point (5,) with the least whitened residual, and what swims there; None if no gain.

        Args:
            tried: (s, 5) the points.
            told: what swims there, in each trial.
            residuals: (s, K) there.
            root: (K, K) of the covariance.
        """
        rows = np.vstack([self._residual, residuals])
        now, *squares = (solve_triangular(root, rows.T, lower=True) ** 2).sum(axis=0)
        for best in np.argsort(squares):
            if squares[best] >= now:
                break
            if not self.forward or self.model.swim_forward(tried[[best]])[0]:
                return np.asarray(tried[best]), [each.part(np.array([best]), each.time_s.shape[-1]) for each in told]
            self._refused |= bool(squares[best] < now - 2 * AS_LIKELY)
            self._blocked |= self._refused
        return None

    def _draw_ahead(self, reach: float, step: np.ndarray, white: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Draw points (s, 5) about part of a step whose twins swim forward from rest, the most promising first."""
        random = np.random.default_rng([31, self._round])
        scatter = _scatter(columns)
        wide = max(1.0, float(np.linalg.norm(columns @ step)) / np.sqrt(5))
        drawn = self._at + reach * (step / 2 + wide * random.standard_normal((_DRAWN, 5)) @ scatter)
        drawn = np.clip(drawn, *COEFFICIENT_BOUNDS)
        squares = ((white - (drawn - self._at) @ columns.T) ** 2).sum(axis=1)
        drawn = drawn[np.argsort(squares)[: int((squares < white @ white).sum())]]
        drawn = drawn[:: max(len(drawn) // _ASKED, 1)]  # the most promising may all be beyond the boundary
        return drawn[self.model.swim_forward(drawn)][:_LOOKED_AT] if len(drawn) else drawn


class _Diverged(Exception):
    """Signal that the twin diverged within a descent."""


def _scatter(columns: np.ndarray) -> np.ndarray:
    """Return the root (5, 5) of the covariance of the coefficients, by a whitened Jacobian (K, 5) and their prior."""
    return np.linalg.inv(np.linalg.cholesky(columns.T @ columns + COEFFICIENT_SD**-2.0 * np.eye(5)))


def _is_finite(block: Block) -> bool:
    return all(np.isfinite(part).all() for part in (*block.sensitivities, block.time_step))


def _rank_in_race(descent: _Descent) -> tuple[bool, float]:
    return not descent.forward, -descent.promise


def _rank(descent: _Descent) -> tuple[bool, float]:
    return not descent.forward, -descent.log_density


def _choose_promising(
    model: SessionModel, points: np.ndarray, simulated: np.ndarray, count: int
) -> tuple[Sequence[np.ndarray], tuple[Block, ...]]:
    """Return the likeliest of the points (s, 5) by what they simulate (s, K), and the blocks they are ranked with.

    The first look is relative to how fast and wide each beat is. Nuisances are simulated at the best point so found; in
    their covariance all points are ranked by their residuals, those first that swim forward from rest.

    Raises:
        SimulationDiverged: the twin diverged at all points.
    """
    measured = model.measured.reshape(len(model.trials), -1)
    rows = simulated.reshape(len(points), *measured.shape)
    speed = (rows[..., SPEED] - measured[..., SPEED]) / np.maximum(np.abs(measured[..., SPEED]), 1e-3)
    wave = np.linalg.norm(rows[..., 1:] - measured[..., 1:], axis=-1) / np.linalg.norm(measured[..., 1:], axis=-1)
    misfit = (speed**2 + wave**2).sum(axis=-1)
    for first in (i for i in np.argsort(misfit) if np.isfinite(misfit[i])):
        blocks = blocks_at(model, points[first], _COARSE)
        if all(map(_is_finite, blocks)):
            break
    else:
        raise SimulationDiverged("the twin diverged from every start; look into the flags of the fit trials")
    root = np.linalg.cholesky(Covariance.of(blocks).at(MEDIANS))
    residual = np.nan_to_num(model.measured - simulated, nan=1e3)
    squares = (solve_triangular(root, residual.T, lower=True) ** 2).sum(axis=0)
    order = np.array([i for i in np.argsort(squares)[: _TRIED * count] if np.isfinite(simulated[i]).all()])
    forward = model.swim_forward(points[order])
    ranked = [*order[forward], *order[~forward]]
    chosen: list[int] = []
    roots = np.sqrt(points / COEFFICIENT_BOUNDS[1])
    for i in ranked:
        if all(np.abs(roots[i] - roots[other]).max() > _STARTS_APART for other in chosen):
            chosen.append(i)
    chosen += [i for i in ranked if i not in chosen]
    return [points[i] for i in chosen[:count]], blocks
