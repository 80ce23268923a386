"""The search for the mode: coefficients by Gauss-Newton, variance components by restricted likelihood.

The two take turns. Each step of the coefficients is that of generalised least squares in the covariance so far, within
the bounds (Stark and Parker 1995, by `scipy.optimize.lsq_linear`), halved until it gains. Many starts, the likeliest of
points all over the box, race against each other; the winner hops about in what the trials allow, for the twin is rough.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.optimize import lsq_linear
from scipy.stats import qmc

from fitting.model.features import SPEED
from fitting.model.mode import Mode, SearchEnd, blocks_at, broyden, coefficient_covariance, jacobian_at
from fitting.model.roll import NO_ROLL, ROLL_SD, Roll
from fitting.model.session_model import SessionModel
from fitting.model.trial_model import trajectories_together
from fitting.model.variance import COEFFICIENT_SD, MEDIANS, Block, Covariance
from fitting.progress import Progress
from session.errors import SimulationDiverged
from swimmer import PUBLISHED_COEFFICIENTS, Trajectories
from swimmer.fluid import COEFFICIENT_BOUNDS

_SCREENED = 128
_SCREENING = 0.3  # share of the time of a search until its descents begin
_TRIED = 4  # times the starts, of which it is asked whether their twins swim forward from rest
_ROUNDS = 14
_RACES = ((2, 1.0), (6, 0.5))
"""Rounds of all descents that are left, and times the starts that go on after them; in the end the better half."""
_BEGUN = 2  # times the starts, descents at first
_APART = 0.25  # of the box in the roots of coefficients, that two starts are at least apart in one of them
_HOPS, _HOPPED, _WIDE = 2, 32, (1.5, 3.0)  # hops; points of each; half of them each with such a scatter, in sd
_RENEWED = (2, 5)  # rounds in which nuisances are simulated anew where the coefficients now are
_NATURALS = tuple(np.linspace(-0.8, 0.8, 9))  # of rolls to begin with, see `Roll.natural`
_SHARES = (1.0, 0.5, 0.25, 0.1)  # of a step
_ALONG = 8  # rounds along the boundary of twins that swim forward from rest
_CLEARLY = 0.5  # gain in log density, below which a twin is as likely: it is as rough as that
_REACHES = (1.0, 0.3)  # of a step and of the scatter of coefficients, within which points are drawn
_DRAWN, _ASKED, _LOOKED_AT = 64, 16, 4  # points; of which is asked whether they swim forward; that are simulated
_STILL = 0.2  # length of a step in standard deviations of the coefficients, below which it is the last
_SHORT = 1.0  # such a length, below which slopes are corrected by what the step did instead of simulated anew


def find_mode(
    model: SessionModel, starts: int = 3, seed: int = 0, tell: Progress = lambda _message, _share: None
) -> Mode:
    """The likeliest coefficients of a session's fitted trials.

    Args:
        model: the trials; their features hold the course.
        starts: how many descents go on to the end or nearly so, of three times as many that begin at the likeliest
            of the screened points, those first whose twins swim forward from rest; on the way these stay so.
        seed: of the screening.
        tell: of the progress.

    Raises:
        SimulationDiverged: from every start.
    """
    tell("looking for starts of the search", 0.0)
    points = _screened(seed)
    promising, blocks = _promising(model, points, model.simulated(points), _BEGUN * starts)
    descents = [_Descent(model, start, blocks) for start in promising]
    racing, before, done, expected = descents, 0, 0, _steps_expected(len(descents), starts)
    for rounds, left in (*_RACES, (_ROUNDS, 0.0)):
        for descent in racing:
            tell("fitting the coefficients", _SCREENING + (1 - _SCREENING) * min(done / expected, 0.99))
            descent.go_on(rounds)
            done += rounds - before
        before = rounds
        racing = sorted(racing, key=_worse)[: max(int(left * starts), 1)]
    while not (found := sorted(descents, key=_worse))[0].done:
        found[0].go_on(_ROUNDS)
    found[0] = found[0].hopped(seed).along_boundary()
    found = [each for each in found if np.isfinite(each.log_density)]
    if not found:
        raise SimulationDiverged("the twin diverged from every start; look into the flags of the fit trials")
    spent = len(points) + sum(each.simulated for each in descents)
    ends = tuple(each.mode.ends[0] for each in found)
    return replace(found[0].mode, ends=ends, simulations=spent)


def _steps_expected(descents: int, starts: int) -> float:
    """Rounds of all descents; of those that go on to the end half the rounds, for they converge on the way."""
    steps, before, racing = 0.0, 0, descents
    for rounds, left in _RACES:
        steps, before, racing = steps + racing * (rounds - before), rounds, max(int(left * starts), 1)
    return steps + racing * (_ROUNDS - before) / 2


class _Descent:
    """From one start, as far as it was told to go.

    Attributes:
        log_density: where it is; -inf where the twin diverged on the way.
    """

    def __init__(self, model: SessionModel, start: np.ndarray, blocks: tuple[Block, ...]) -> None:
        self.model, self.start, self.simulated = model, start, 0
        self.forward = bool(model.swim_forward(start[None])[0])
        self._blocks, self._covariance = blocks, Covariance.of(blocks)
        self.log_density, self._round, self._converged = -np.inf, 0, False
        self._at, self._sizes = start, dict(MEDIANS)
        self._trajectories = trajectories_together(model.trials, start[None])
        self._jacobian, self._sloped = np.zeros((0, 5)), False
        self._follows_boundary = False

    @property
    def done(self) -> bool:
        """Whether going on changes nothing."""
        return self._converged or self._round >= _ROUNDS

    def go_on(self, rounds: int) -> None:
        """Goes on until so many rounds are behind it, until it has converged, or until the twin diverges."""
        try:
            while self._round < rounds and not self._converged:
                self._step()
            self._look(sloped=True)
        except _Diverged:
            self.log_density, self._converged = -np.inf, True

    def hopped(self, seed: int) -> "_Descent":
        """Gone on from the best of points drawn about it, if that leads to where it is likelier; else itself.

        The twin is rough by some hundredths of a millimetre, so that gradients end in hollows of that depth.
        """
        best, random = self, np.random.default_rng([seed, 37])
        for _ in range(_HOPS if np.isfinite(self.log_density) else 0):
            root, _, columns = best._whitened(best._covariance.at(best._sizes))
            scatter = np.linalg.inv(np.linalg.cholesky(columns.T @ columns + COEFFICIENT_SD**-2.0 * np.eye(5)))
            wide = np.repeat(_WIDE, _HOPPED // len(_WIDE))[:, None]
            drawn = best._at + wide * random.standard_normal((_HOPPED, 5)) @ scatter
            there = best._best(np.clip(drawn, *COEFFICIENT_BOUNDS), root)
            self.simulated = best.simulated
            if there is None:
                break
            other = copy(best)
            other._at, other._trajectories = there
            other._jacobian, other._sloped, other._converged = np.zeros((0, 5)), False, False
            other.go_on(best._round + _RACES[-1][0])
            self.simulated = other.simulated
            if other.log_density <= best.log_density:
                break
            best = other
        return best

    def along_boundary(self) -> "_Descent":
        """Gone on along the boundary of twins that swim forward from rest, if that is clearly likelier; else itself.

        Steps that cross it are refused. It has no gradient, for beyond it a twin settles in another steady state: so
        points are drawn about part of the step, with the covariance of the coefficients, and each is simulated from
        rest.
        """
        if not (self.forward and np.isfinite(self.log_density)):
            return self
        _, white, columns = self._whitened(self._covariance.at(self._sizes))
        if white @ white - ((white - columns @ self._free_step(white, columns)) ** 2).sum() < 2 * _CLEARLY:
            return self
        other = copy(self)
        other._follows_boundary, other._converged = True, False
        other.go_on(self._round + _ALONG)
        self.simulated = other.simulated
        return other if other.log_density > self.log_density + _CLEARLY else self

    def _step(self) -> None:
        if self._round in _RENEWED:
            blocks = blocks_at(self.model, self._at)
            self.simulated += 16
            if all(map(_is_finite, blocks)):  # next to it a twin may diverge
                self._blocks, self._covariance = blocks, Covariance.of(blocks)
        self._look()
        jacobian, others = self._jacobian, self._covariance.without_roll(self._sizes) + _free(self._jacobian)
        if self._round in (0, *_RENEWED):
            self._start_roll(others)
        rolled = self._roll(others)
        total = self._covariance.at(self._sizes)
        root = np.linalg.cholesky(np.linalg.inv(coefficient_covariance(total, jacobian)))
        before, residual = self._at, self._residual
        self._at, self._trajectories = self._stepped(total)
        length = self._slope_on(before, residual, root)
        still = length is not None and np.hypot(length, rolled) < _STILL
        self._converged = bool(still) and self._round >= _RENEWED[0]
        self._round += 1

    def _slope_on(self, before: np.ndarray, residual: np.ndarray, root: np.ndarray) -> float | None:
        """Slopes after a step from coefficients (5,) with their residual (K,); its length, None to try it again.

        Args:
            before, residual: where the step began.
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
        """Where it is: residual, slopes, the likeliest sizes there; the slopes simulated where `sloped` or unknown."""
        self._residual = self._residual_with(None)
        if not len(self._jacobian) or (sloped and not self._sloped):
            self._jacobian, self._sloped = jacobian_at(self.model.trials, self._at), True
            self.simulated += 10
        if not (np.isfinite(self._residual).all() and np.isfinite(self._jacobian).all()):
            raise _Diverged
        self._sizes, deviance = self._covariance.restricted(self._residual, self._jacobian, self._sizes)
        self.log_density = -deviance - self.model.trials[0].roll.deviance

    def _residual_with(self, roll: Roll | None) -> np.ndarray:
        """(K,) where it is, with another roll of the hull or with its own."""
        trials = self.model.trials if roll is None else self.model.rolling(roll).trials
        rows = [trial.features_of(each)[0] for trial, each in zip(trials, self._trajectories, strict=True)]
        return np.asarray(self.model.measured - np.concatenate(rows))

    @property
    def mode(self) -> Mode:
        """Where it is."""
        end = SearchEnd(self.start, self._at, self.log_density, self._converged, self.forward)
        return Mode(
            self.model,
            self._at,
            self._sizes,
            self._covariance,
            self._blocks,
            self._residual,
            self._jacobian,
            (end,),
            self.simulated,
        )

    def _start_roll(self, total: np.ndarray) -> None:
        """Begins with the likeliest roll of a few natural frequencies, in a covariance (K, K) of all else.

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
        """Goes on to the likeliest roll, linear, in a covariance (K, K) of all else; the way in standard deviations."""
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

    def _stepped(self, total: np.ndarray) -> tuple[np.ndarray, list[Trajectories]]:
        """(5,) one step on and what swims there, or the same where nothing that is tried gains.

        A twin that swims forward from rest goes on to.
        """
        root, white, columns = self._whitened(total)
        step = self._free_step(white, columns)
        for shares in (_SHARES[:1], _SHARES[1:]):
            tried = np.clip(self._at + np.outer(shares, step), *COEFFICIENT_BOUNDS)
            if (there := self._best(tried, root)) is not None:
                return there
        for reach in _REACHES if self._follows_boundary else ():
            if (there := self._best(self._drawn(reach, step, white, columns), root)) is not None:
                return there
        return self._at, self._trajectories

    def _whitened(self, total: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(K, K) root of a covariance (K, K), and residual (K,) and slopes (K, 5) whitened by it."""
        root = np.linalg.cholesky(total)
        return root, *(solve_triangular(root, each, lower=True) for each in (self._residual, self._jacobian))

    def _free_step(self, white: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """(5,) to the least squares within the bounds, linear, of a whitened residual (K,) with slopes (K, 5)."""
        low, high = COEFFICIENT_BOUNDS
        return np.asarray(lsq_linear(columns, white, bounds=(low - self._at - 1e-9, high - self._at + 1e-9)).x)

    def _best(self, tried: np.ndarray, root: np.ndarray) -> tuple[np.ndarray, list[Trajectories]] | None:
        """Of points (s, 5) that which leaves least, whitened by a root (K, K), and what swims there; None: no gain."""
        if not len(tried):
            return None
        told = trajectories_together(self.model.trials, tried)
        self.simulated += len(tried)
        rows = self.model.measured - np.hstack(
            [trial.features_of(each) for trial, each in zip(self.model.trials, told, strict=True)]
        )
        rows = np.vstack([self._residual, np.nan_to_num(rows, nan=1e3)])
        now, *squares = (solve_triangular(root, rows.T, lower=True) ** 2).sum(axis=0)
        for best in np.argsort(squares):
            if squares[best] >= now:
                break
            if not self.forward or self.model.swim_forward(tried[[best]])[0]:
                return np.asarray(tried[best]), [each.part(np.array([best]), each.time_s.shape[-1]) for each in told]
        return None

    def _drawn(self, reach: float, step: np.ndarray, white: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """(s, 5) points about part of a step whose twins swim forward from rest, the most promising by slopes first."""
        random = np.random.default_rng([31, self._round])
        scatter = np.linalg.inv(np.linalg.cholesky(columns.T @ columns + COEFFICIENT_SD**-2.0 * np.eye(5)))
        wide = max(1.0, float(np.linalg.norm(columns @ step)) / np.sqrt(5))
        drawn = self._at + reach * (step / 2 + wide * random.standard_normal((_DRAWN, 5)) @ scatter)
        drawn = np.clip(drawn, *COEFFICIENT_BOUNDS)
        squares = ((white - (drawn - self._at) @ columns.T) ** 2).sum(axis=1)
        drawn = drawn[np.argsort(squares)[: int((squares < white @ white).sum())]]
        drawn = drawn[:: max(len(drawn) // _ASKED, 1)]  # the most promising may all be beyond the boundary
        return drawn[self.model.swim_forward(drawn)][:_LOOKED_AT] if len(drawn) else drawn


class _Diverged(Exception):
    """What a descent meets where the twin diverges."""


def _is_finite(block: Block) -> bool:
    return all(np.isfinite(part).all() for part in (*block.sensitivities, block.time_step))


def _worse(descent: _Descent) -> tuple[bool, float]:
    return not descent.forward, -descent.log_density


def _free(jacobian: np.ndarray) -> np.ndarray:
    """(K, K) what coefficients make that may be anywhere."""
    return np.asarray(COEFFICIENT_SD**2 * jacobian @ jacobian.T)


def _screened(seed: int) -> np.ndarray:
    """(s, 5) over the box, even in the roots; the published coefficients first."""
    box = COEFFICIENT_BOUNDS[1] * qmc.Sobol(5, seed=seed).random_base2(int(np.ceil(np.log2(_SCREENED)))) ** 2
    return np.vstack([PUBLISHED_COEFFICIENTS, box[: _SCREENED - 1]])


def _promising(
    model: SessionModel, points: np.ndarray, simulated: np.ndarray, count: int
) -> tuple[Sequence[np.ndarray], tuple[Block, ...]]:
    """Return the likeliest of the points (s, 5) by what they simulate (s, K), and the blocks they are ranked with.

    The first look is relative to how fast and wide each beat is. Nuisances are simulated where it finds most; in their
    covariance all points are ranked by what they leave, those first that swim forward from rest.

    Raises:
        SimulationDiverged: at all points.
    """
    measured = model.measured.reshape(len(model.trials), -1)
    rows = simulated.reshape(len(points), *measured.shape)
    speed = (rows[..., SPEED] - measured[..., SPEED]) / np.maximum(np.abs(measured[..., SPEED]), 1e-3)
    wave = np.linalg.norm(rows[..., 1:] - measured[..., 1:], axis=-1) / np.linalg.norm(measured[..., 1:], axis=-1)
    misfit = (speed**2 + wave**2).sum(axis=-1)
    for first in (i for i in np.argsort(misfit) if np.isfinite(misfit[i])):
        blocks = blocks_at(model, points[first])
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
        if all(np.abs(roots[i] - roots[other]).max() > _APART for other in chosen):
            chosen.append(i)
    chosen += [i for i in ranked if i not in chosen]
    return [points[i] for i in chosen[:count]], blocks
