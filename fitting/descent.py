"""Descent of the search from one start to the nearest maximum of the posterior density.

Coefficients step by generalised least squares in the covariance so far, within the bounds (Stark and Parker 1995, by
`scipy.optimize.lsq_linear`), shortened until the step gains; variance components follow by restricted likelihood
(Patterson and Thompson 1971), the roll of the hull by a step of its own. They take turns.
"""

from copy import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.optimize import lsq_linear

from fitting.covariance import COEFFICIENT_SD, MEDIANS, Block, Covariance
from fitting.mode import AS_LIKELY, FINER, Mode, SearchEnd, blocks_at, broyden, coefficient_covariance, jacobian_at
from fitting.session_model import SessionModel
from fitting.trial_model import NO_ROLL, ROLL_SD, Roll, trajectories_together
from swimcal.mjcf import COEFFICIENT_BOUNDS
from swimcal.runs import Trajectories

ROUNDS = 14
"""Largest number of rounds of a descent."""
RENEWED = (2, 5)
"""Rounds in which nuisances are simulated anew at the present coefficients."""
COARSE = 2
"""Fine steps in one step of the twin until a descent is refined, see `fitting.mode.FINER`."""
DRAWN = 64
"""Points drawn along the boundary of twins that swim forward."""
_REFINED = 2  # how often nuisances are simulated anew in the end
_REFINING = 4  # rounds after each time
_NATURALS = tuple(np.linspace(-0.8, 0.8, 9))  # natural frequencies of the first rolls, see `Roll.natural`
_SHARES = (1.0, 0.5, 0.25, 0.1)  # shares of a step that are tried
_REACHES = (1.0, 0.3)  # shares of a step and of the coefficients' scatter within which points are drawn
_ASKED = 16  # points of those drawn that are simulated from rest
_LOOKED_AT = 4  # points of these that are simulated in the trials
_STILL = 0.2  # a step shorter than this, in standard deviations of the coefficients, is the last
_SHORT = 1.0  # after a step shorter than this the Jacobian is updated instead of simulated anew
_FAR_OFF = 1e3  # residual of features of a twin that diverges


class Place(NamedTuple):
    """Place of a descent: coefficients (5,), and what swims with them in each trial."""

    at: np.ndarray
    trajectories: list[Trajectories]


class Tried(NamedTuple):
    """Points (s, 5) that were simulated: what swims there in each trial, and the residuals (s, K)."""

    points: np.ndarray
    trajectories: list[Trajectories]
    residuals: np.ndarray

    def place(self, number: int) -> Place:
        """Return one of the points as a place."""
        rows = np.array([number])
        return Place(self.points[number], [each.part(rows, each.time_s.shape[-1]) for each in self.trajectories])


class Whitened(NamedTuple):
    """Residual (K,) and Jacobian (K, 5), whitened by the root (K, K) of a covariance."""

    root: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray

    @property
    def scatter(self) -> np.ndarray:
        """Root (5, 5) of the covariance of the coefficients, with their prior."""
        return np.linalg.inv(np.linalg.cholesky(self.jacobian.T @ self.jacobian + COEFFICIENT_SD**-2.0 * np.eye(5)))

    def step_from(self, at: np.ndarray) -> np.ndarray:
        """Return the least-squares step (5,) from coefficients (5,) within the bounds."""
        low, high = COEFFICIENT_BOUNDS
        found = lsq_linear(self.jacobian, self.residual, bounds=(low - at - 1e-9, high - at + 1e-9))
        return np.asarray(found.x)

    def squares_after(self, step: np.ndarray) -> np.ndarray:
        """Return the squares that steps (…, 5) leave, were the twin linear."""
        return np.asarray(((self.residual - step @ self.jacobian.T) ** 2).sum(axis=-1))

    def squares_of(self, residuals: np.ndarray) -> np.ndarray:
        """Return the whitened squares (s,) of residuals (s, K)."""
        return np.asarray((solve_triangular(self.root, residuals.T, lower=True) ** 2).sum(axis=0))


class Descent:
    """A descent from one start, as far as it was told to go.

    Attributes:
        log_density: log density where it is; -inf where the twin diverged on the way.
        promise: log density where the next step would lead, were the twin linear and every step allowed: that of the
            variance components, with the coefficients integrated out.
        forward: the twin of the start swims forward from rest, and those of all places after it have to.
        blocked: clearly likelier places were refused since, as their twins do not.
        follows_boundary: where a step is refused for that, points about it are tried.
        spread: (5,) standard deviations of where single steps from points about the end lead; 0 where not told.
        simulated: how often the trials were simulated.
    """

    def __init__(self, model: SessionModel, start: np.ndarray, blocks: tuple[Block, ...]) -> None:
        self.model, self.start, self.simulated = model, start, 0
        self.forward, self.blocked, self.follows_boundary = bool(model.swim_forward(start[None])[0]), False, False
        self.log_density, self.promise, self.spread = -np.inf, -np.inf, np.zeros(5)
        self._place = Place(start, trajectories_together(model.trials, start[None]))
        self._blocks, self._covariance, self._finer, self._sizes = blocks, Covariance.of(blocks), COARSE, dict(MEDIANS)
        self._jacobian, self._sloped = np.zeros((0, 5)), False
        self._round, self._converged, self._refused = 0, False, False

    @property
    def at(self) -> np.ndarray:
        """Coefficients (5,) where it is."""
        return self._place.at

    @property
    def alive(self) -> bool:
        """Return whether the twin has not diverged on the way."""
        return bool(np.isfinite(self.log_density))

    @property
    def done(self) -> bool:
        """Return whether further steps change nothing."""
        return self._converged or self._round >= ROUNDS

    @property
    def mode(self) -> Mode:
        """Mode at the present place."""
        end = SearchEnd(self.start, self.at, self.log_density, self._converged, self.forward, self._refused)
        look = self._covariance, self._blocks, self._residual, self._jacobian
        return Mode(self.model, self.at, self._sizes, *look, (end,), self.simulated, self.spread)

    def run(self, rounds: int) -> None:
        """Iterate until so many rounds are done, until convergence, or until the twin diverges."""
        try:
            while self._round < rounds and not self._converged:
                self._step()
            self._look(sloped=True)
        except _Diverged:
            self.log_density, self.promise, self._converged = -np.inf, -np.inf, True

    def run_on(self, rounds: int) -> None:
        """Iterate for so many rounds more, converged or not."""
        self._converged = False
        self.run(self._round + rounds)

    def settle(self, clearly: float) -> None:
        """Go on where it has not converged, and take a gain below `clearly` in log density for convergence.

        The twin is rough: steps to and fro between places that are about as likely may stay long.
        """
        if not self._converged:
            before = self.log_density
            self.run_on(ROUNDS)
            self._converged |= abs(self.log_density - before) < clearly

    def refine(self, finer: int = FINER) -> None:
        """Go on with the error of the time step that so many fine steps in one tell.

        Far from the end it would lead astray: it changes with the coefficients, and no step accounts for that.
        """
        if self.alive:
            self._finer = finer
            for _ in range(_REFINED):
                self._renew()
                self.run_on(_REFINING)

    def look_back(self) -> None:
        """Tell anew whether the twin swims forward from rest, if that of the start did not."""
        if not self.forward and self.alive:
            self.forward = bool(self.model.swim_forward(self.at[None])[0])

    def moved(self, place: Place) -> "Descent":
        """Return this descent at another place, from where it has to run on."""
        other = copy(self)
        other._place, other._jacobian, other._sloped = place, np.zeros((0, 5)), False
        return other

    def whitened(self) -> Whitened:
        """Whiten residual and Jacobian by the covariance of the features."""
        return self._whitened_by(self._covariance.at(self._sizes))

    def swim_at(self, points: np.ndarray) -> Tried:
        """Simulate points (s, 5) in all trials."""
        told = trajectories_together(self.model.trials, points)
        self.simulated += len(points)
        rows = np.hstack([trial.features_of(each) for trial, each in zip(self.model.trials, told, strict=True)])
        return Tried(points, told, np.nan_to_num(self.model.measured - rows, nan=_FAR_OFF))

    def best_of(self, tried: Tried, white: Whitened) -> Place | None:
        """Return the place with the least whitened residual; None if none gains.

        Of a descent that has to swim forward, it is one whose twin does.
        """
        now, *squares = white.squares_of(np.vstack([self._residual, tried.residuals]))
        for best in np.argsort(squares).tolist():
            if squares[best] >= now:
                break
            if not self.forward or self.model.swim_forward(tried.points[[best]])[0]:
                return tried.place(best)
            self._refused |= bool(squares[best] < now - 2 * AS_LIKELY)
            self.blocked |= self._refused
        return None

    def _step(self) -> None:
        if self._round in RENEWED:
            self._renew()
        self._look()
        jacobian = self._jacobian
        others = self._covariance.without_roll(self._sizes) + COEFFICIENT_SD**2 * jacobian @ jacobian.T
        if self._round in (0, *RENEWED):
            self._start_roll(others)
        rolled = self._step_roll(others)
        total = self._covariance.at(self._sizes)
        root = np.linalg.cholesky(np.linalg.inv(coefficient_covariance(total, jacobian)))
        before, residual = self.at, self._residual
        self._place = self._take_step(self._whitened_by(total))
        length = self._update_jacobian(before, residual, root)
        still = length is not None and np.hypot(length, rolled) < _STILL
        self._converged = bool(still) and self._round >= RENEWED[0]
        self._round += 1

    def _renew(self) -> None:
        """Simulate the nuisances anew at the present place, unless a twin next to it diverges."""
        blocks = blocks_at(self.model, self.at, self._finer)
        self.simulated += 14 + self._finer
        if all(block.is_finite for block in blocks):
            self._blocks, self._covariance = blocks, Covariance.of(blocks)

    def _look(self, sloped: bool = False) -> None:
        """Update residual, Jacobian and likeliest sizes at the present place.

        The Jacobian is simulated if `sloped`, or if it is unknown.
        """
        self._residual = self._residual_with(None)
        if not len(self._jacobian) or (sloped and not self._sloped):
            self._jacobian, self._sloped = jacobian_at(self.model.trials, self.at), True
            self.simulated += 10
        if not (np.isfinite(self._residual).all() and np.isfinite(self._jacobian).all()):
            raise _Diverged
        self._sizes, deviance = self._covariance.restricted(self._residual, self._jacobian, self._sizes)
        white = self.whitened()
        self.promise = -deviance - self.model.trials[0].roll.deviance
        gain = float(white.residual @ white.residual - white.squares_after(white.step_from(self.at)))
        self.log_density = self.promise - 0.5 * gain

    def _residual_with(self, roll: Roll | None) -> np.ndarray:
        """Return the residual (K,) at the present place, with another roll of the hull or with its own."""
        trials = self.model.trials if roll is None else self.model.rolling(roll).trials
        rows = [trial.features_of(each)[0] for trial, each in zip(trials, self._place.trajectories, strict=True)]
        return np.asarray(self.model.measured - np.concatenate(rows))

    def _whitened_by(self, total: np.ndarray) -> Whitened:
        root = np.linalg.cholesky(total)
        return Whitened(root, *(solve_triangular(root, each, lower=True) for each in (self._residual, self._jacobian)))

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

    def _step_roll(self, total: np.ndarray) -> float:
        """Step to the likeliest roll, and return the step in standard deviations.

        The step is linear, in a covariance (K, K) of all else.
        """
        roll, trials = self.model.trials[0].roll, zip(self.model.trials, self._place.trajectories, strict=True)
        rolls = np.vstack([trial.slopes_of_roll(each) for trial, each in trials])
        factor = cho_factor(total, lower=True)
        information = rolls.T @ cho_solve(factor, rolls) + np.eye(2)
        pull = rolls.T @ cho_solve(factor, self._residual) - np.array(roll) / ROLL_SD
        there = roll.moved(np.linalg.solve(information, pull))
        self.model = self.model.rolling(there)
        self._residual, self._covariance = self._residual_with(None), replace(self._covariance, rolls=rolls)
        step = (np.array(there) - np.array(roll)) / ROLL_SD
        return float(np.sqrt(step @ information @ step))

    def _take_step(self, white: Whitened) -> Place:
        """Return the place one step on, or the present one where nothing that is tried gains."""
        step, self._refused = white.step_from(self.at), False
        for shares in (_SHARES[:1], _SHARES[1:]):
            tried = np.clip(self.at + np.outer(shares, step), *COEFFICIENT_BOUNDS)
            if (there := self.best_of(self.swim_at(tried), white)) is not None:
                return there
        for reach in _REACHES if self.follows_boundary else ():
            drawn = self._draw_ahead(reach, step, white)
            if len(drawn) and (there := self.best_of(self.swim_at(drawn), white)) is not None:
                return there
        return self._place

    def _draw_ahead(self, reach: float, step: np.ndarray, white: Whitened) -> np.ndarray:
        """Draw points (s, 5) about part of a step whose twins swim forward from rest, the most promising first.

        The boundary has no gradient, as beyond it a twin settles in another steady state: so points are drawn, with the
        covariance of the coefficients, and each is simulated from rest.
        """
        random = np.random.default_rng([31, self._round])
        wide = max(1.0, float(np.linalg.norm(white.jacobian @ step)) / np.sqrt(5))
        drawn = self.at + reach * (step / 2 + wide * random.standard_normal((DRAWN, 5)) @ white.scatter)
        drawn = np.clip(drawn, *COEFFICIENT_BOUNDS)
        squares = white.squares_after(drawn - self.at)
        drawn = drawn[np.argsort(squares)[: int((squares < white.residual @ white.residual).sum())]]
        drawn = drawn[:: max(len(drawn) // _ASKED, 1)]  # the most promising may all be beyond the boundary
        return drawn[self.model.swim_forward(drawn)][:_LOOKED_AT] if len(drawn) else drawn

    def _update_jacobian(self, before: np.ndarray, residual: np.ndarray, root: np.ndarray) -> float | None:
        """Update the Jacobian after a step, and return the step's length; None to try it again.

        Args:
            before: (5,) coefficients where the step began.
            residual: (K,) the residual there.
            root: (5, 5) of the information about the coefficients, by which lengths are measured.
        """
        step, sloped = self.at - before, self._sloped
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


class _Diverged(Exception):
    """Signal that the twin diverged within a descent."""
