"""The mode of the hierarchical model: coefficients by Gauss-Newton, variance components by restricted likelihood.

The two take turns. Each step of the coefficients is that of generalised least squares in the covariance so far, within
the bounds (Stark and Parker 1995, by `scipy.optimize.lsq_linear`), halved until it gains. A few starts, the likeliest
of points all over the box, guard against other valleys.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.optimize import lsq_linear
from scipy.stats import qmc

from fitting.model.features import SPEED
from fitting.model.roll import NO_ROLL, ROLL_SD, Roll
from fitting.model.session_model import SessionModel
from fitting.model.trial_model import TrialModel, freedoms_together, simulated_together, trajectories_together
from fitting.model.variance import COEFFICIENT_SD, FORECAST_SPEED, MEDIANS, Block, Covariance
from fitting.objective import COEFFICIENT_BOUNDS
from session.errors import SimulationDiverged
from swimmer import PUBLISHED_COEFFICIENTS, Trajectories

Progress = Callable[[str, float | None], None]
_SCREENED = 48
_TRIED = 4  # times the starts, of which it is asked whether their twins swim forward from rest
_ROUNDS = 14
_RACED = 6  # rounds of all descents, after which the better half goes on
_RENEWED = (2, 5)  # rounds in which nuisances are simulated anew where the coefficients now are
_NATURALS = tuple(np.linspace(-0.8, 0.8, 9))  # of rolls to begin with, see `Roll.natural`
_ROOT_STEP = 0.08  # of the differences, in roots of coefficients: Kutta lift roughens the twin below that
_SHARES = (1.0, 0.5, 0.25, 0.1)  # of a step
_STILL = 0.2  # length of a step in standard deviations of the coefficients, below which it is the last
_SHORT = 1.0  # such a length, below which slopes are corrected by what the step did instead of simulated anew
_APART = 1.0  # square root of the mean squared distance, in standard deviations, from which two ends differ
_AS_LIKELY = 2.0  # log density within which two ends are as likely


class SearchEnd(NamedTuple):
    """Where one start ended.

    Attributes:
        start, coefficients: (5,) before and after.
        log_density: ln of the marginal posterior of the variance components, coefficients integrated out.
        converged: the last step was short.
        forward: started from rest, the twin swims forward.
    """

    start: np.ndarray
    coefficients: np.ndarray
    log_density: float
    converged: bool
    forward: bool


@dataclass(frozen=True, eq=False)
class Mode:
    """The likeliest coefficients, and the normal approximation about them (Laplace).

    Attributes:
        model: the trials it rests on, with the likeliest roll of the hull.
        coefficients: (5,).
        sizes: standard deviation of each variance component, by its name.
        covariance: of the features.
        blocks: of the trials, in the order of the row.
        residual: (K,) measured less simulated.
        jacobian: (K, 5) of the simulated features.
        ends: of all starts, the best first.
        simulations: how often the trials were simulated.
    """

    model: SessionModel
    coefficients: np.ndarray
    sizes: Mapping[str, float]
    covariance: Covariance
    blocks: tuple[Block, ...]
    residual: np.ndarray
    jacobian: np.ndarray
    ends: tuple[SearchEnd, ...]
    simulations: int

    @property
    def roll(self) -> Roll:
        """The likeliest of the hull; how far it may be off is part of the covariance."""
        return self.model.trials[0].roll

    @property
    def total(self) -> np.ndarray:
        """(K, K) covariance of the residual."""
        return self.covariance.at(self.sizes)

    @property
    def forecast_sizes(self) -> Mapping[str, float]:
        """Standard deviation of each component in forecasts."""
        return {**self.sizes, "speed_common": FORECAST_SPEED}

    @property
    def coefficient_covariance(self) -> np.ndarray:
        """(5, 5) of the coefficients, by the curvature and the width of their prior."""
        return _coefficient_covariance(self.total, self.jacobian)

    def simulated(self, number: int) -> np.ndarray:
        """(k,) features of the twin in a fitted trial."""
        length = len(self.blocks[number].model.measured)
        return self.blocks[number].model.measured - self.residual[number * length :][:length]

    @property
    def disagree(self) -> tuple[SearchEnd, ...]:
        """Ends as likely as the best, and elsewhere."""
        sd = np.sqrt(np.diag(self.coefficient_covariance))
        best = self.ends[0]

        def apart(end: SearchEnd) -> bool:
            return bool(np.sqrt(np.mean(((end.coefficients - best.coefficients) / sd) ** 2)) > _APART)

        return tuple(
            end
            for end in self.ends[1:]
            if end.forward == best.forward and end.log_density > best.log_density - _AS_LIKELY and apart(end)
        )


def find_mode(
    model: SessionModel, starts: int = 3, seed: int = 0, tell: Progress = lambda _message, _share: None
) -> Mode:
    """The likeliest coefficients of a session's fitted trials.

    Args:
        model: the trials; their features hold the course.
        starts: how many of the screened points are gone on from, those first whose twins swim forward from rest; on
            the way there these stay so.
        seed: of the screening.
        tell: of the progress.

    Raises:
        SimulationDiverged: from every start.
    """
    points = _screened(seed)
    simulated = model.simulated(points)
    promising = _promising(model, points, simulated, starts)
    blocks = blocks_at(model, promising[0])
    descents = [_Descent(model, start, blocks) for start in promising]
    for number, descent in enumerate(descents):
        tell("fitting the coefficients", 0.5 * number / starts)
        descent.go_on(min(_RACED, _ROUNDS))
    descents.sort(key=_worse)
    for number, descent in enumerate(descents[: (starts + 1) // 2]):
        tell("fitting the coefficients", 0.5 + number / starts)
        descent.go_on(_ROUNDS)
    while not (found := sorted(descents, key=_worse))[0].done:
        found[0].go_on(_ROUNDS)
    found = [each for each in found if np.isfinite(each.log_density)]
    if not found:
        raise SimulationDiverged("the twin diverged from every start; look into the flags of the fit trials")
    spent = len(points) + sum(each.simulated for each in descents)
    ends = tuple(each.mode.ends[0] for each in found)
    return replace(found[0].mode, ends=ends, simulations=spent)


def mode_at(
    model: SessionModel,
    coefficients: np.ndarray,
    sizes: Mapping[str, float],
    roll: Roll = NO_ROLL,
    ends: tuple[SearchEnd, ...] = (),
) -> Mode:
    """The normal approximation about coefficients (5,) that are known, with variance components of known sizes.

    Args:
        model: the trials.
        coefficients: where.
        sizes: standard deviation of each variance component, by its name.
        roll: of the hull.
        ends: of the search that found them.
    """
    model = model.rolling(roll)
    blocks = blocks_at(model, coefficients)
    residual = model.measured - model.simulated(coefficients[None])[0]
    jacobian = jacobian_at(model.trials, coefficients)
    covariance = Covariance.of(blocks)
    return Mode(model, coefficients, sizes, covariance, blocks, residual, jacobian, ends, simulations=0)


def blocks_at(model: SessionModel, coefficients: np.ndarray) -> tuple[Block, ...]:
    """The blocks of trials that are fitted, with what nuisances do at coefficients (5,)."""
    freedoms = freedoms_together(model.trials, coefficients)
    trials = zip(model.trials, freedoms, time_step_errors(model.trials, coefficients), strict=True)
    return tuple(
        Block(each, own, each.noise_covariance, time_step, number, each.measured)
        for number, (each, own, time_step) in enumerate(trials)
    )


def jacobian_at(trials: Sequence[TrialModel], coefficients: np.ndarray) -> np.ndarray:
    """(K, 5) of the simulated features with the coefficients (5,), by central differences within the bounds."""
    steps = 2 * _ROOT_STEP * np.sqrt(np.maximum(coefficients, 0.01))
    up, down = (np.clip(coefficients + sign * np.diag(steps), *COEFFICIENT_BOUNDS) for sign in (1, -1))
    rows = np.hstack(simulated_together(trials, np.vstack([up, down])))
    return np.asarray(((rows[:5] - rows[5:]) / np.diag(up - down)[:, None]).T)


def time_step_errors(trials: Sequence[TrialModel], coefficients: np.ndarray) -> list[np.ndarray]:
    """(k,) each, what simulated features lack that a vanishing time step would show, at coefficients (5,).

    Twice the change from whole to half steps, for the integrator is of first order (Richardson 1911). The coefficients
    belong to the twin as it is stepped, so that a calibrated model swims as it was fitted; the error widens intervals.
    """
    twin = trials[0].twin
    finer = twin.at_step(twin.scene.timestep_s / 2)
    whole, half = (
        simulated_together(each, coefficients[None])
        for each in (trials, [replace(trial, twin=finer) for trial in trials])
    )
    return [2 * (after[0] - before[0]) for before, after in zip(whole, half, strict=True)]


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

    @property
    def done(self) -> bool:
        """Whether going on changes nothing."""
        return self._converged or self._round >= _ROUNDS

    def go_on(self, rounds: int) -> None:
        """Goes on until so many rounds are behind it, or until it has converged."""
        try:
            while self._round < rounds and not self._converged:
                self._step()
            self._look(sloped=True)
        except (np.linalg.LinAlgError, ValueError):  # what is simulated is not finite
            self.log_density, self._converged = -np.inf, True

    def _step(self) -> None:
        if self._round in _RENEWED:
            self._blocks = blocks_at(self.model, self._at)
            self._covariance = Covariance.of(self._blocks)
            self.simulated += 16
        self._look()
        jacobian, others = self._jacobian, self._covariance.without_roll(self._sizes) + _free(self._jacobian)
        if self._round in (0, *_RENEWED):
            self._start_roll(others)
        rolled = self._roll(others)
        total = self._covariance.at(self._sizes)
        root = np.linalg.cholesky(np.linalg.inv(_coefficient_covariance(total, jacobian)))
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
        self._jacobian = _corrected(self._jacobian, step, change, root) if length < _SHORT else self._jacobian[:0]
        return length

    def _look(self, sloped: bool = False) -> None:
        """Where it is: residual, slopes, the likeliest sizes there; the slopes simulated where `sloped` or unknown."""
        self._residual = self._residual_with(None)
        if not len(self._jacobian) or (sloped and not self._sloped):
            self._jacobian, self._sloped = jacobian_at(self.model.trials, self._at), True
            self.simulated += 10
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
        """(5,) one step on and what swims there, or the same where no share of it gains.

        A twin that swims forward from rest goes on to.
        """
        root = np.linalg.cholesky(total)
        white, columns = (solve_triangular(root, each, lower=True) for each in (self._residual, self._jacobian))
        low, high = COEFFICIENT_BOUNDS
        step = lsq_linear(columns, white, bounds=(low - self._at - 1e-9, high - self._at + 1e-9)).x
        for shares in (_SHARES[:1], _SHARES[1:]):
            tried = np.clip(self._at + np.outer(shares, step), low, high)
            told = trajectories_together(self.model.trials, tried)
            self.simulated += len(tried)
            rows = self.model.measured - np.hstack(
                [trial.features_of(each) for trial, each in zip(self.model.trials, told, strict=True)]
            )
            squares = np.nan_to_num(
                (solve_triangular(root, np.nan_to_num(rows, nan=1e3).T, lower=True) ** 2).sum(axis=0)
            )
            for best in np.argsort(squares):
                if squares[best] >= white @ white:
                    break
                if not self.forward or self.model.swim_forward(tried[[best]])[0]:
                    return np.asarray(tried[best]), [
                        each.part(np.array([best]), each.time_s.shape[-1]) for each in told
                    ]
        return self._at, self._trajectories


def _corrected(jacobian: np.ndarray, step: np.ndarray, change: np.ndarray, root: np.ndarray) -> np.ndarray:
    """(K, 5) slopes that give the change (K,) that a step (5,) made, else as they were (Broyden 1965, good update).

    The length of a step is measured by the root (5, 5) of the information about the coefficients.
    """
    along = root @ (root.T @ step)
    return np.asarray(jacobian + np.outer(change - jacobian @ step, along) / (step @ along))


def _worse(descent: _Descent) -> tuple[bool, float]:
    return not descent.forward, -descent.log_density


def _free(jacobian: np.ndarray) -> np.ndarray:
    """(K, K) what coefficients make that may be anywhere."""
    return np.asarray(COEFFICIENT_SD**2 * jacobian @ jacobian.T)


def _coefficient_covariance(total: np.ndarray, jacobian: np.ndarray) -> np.ndarray:
    information = jacobian.T @ cho_solve(cho_factor(total, lower=True), jacobian)
    return np.linalg.inv(information + COEFFICIENT_SD**-2.0 * np.eye(jacobian.shape[1]))


def _screened(seed: int) -> np.ndarray:
    """(s, 5) over the box, even in the roots; the published coefficients first."""
    box = COEFFICIENT_BOUNDS[1] * qmc.Sobol(5, seed=seed).random_base2(int(np.ceil(np.log2(_SCREENED)))) ** 2
    return np.vstack([PUBLISHED_COEFFICIENTS, box[: _SCREENED - 1]])


def _promising(model: SessionModel, points: np.ndarray, simulated: np.ndarray, starts: int) -> Sequence[np.ndarray]:
    """The likeliest of the points (s, 5) by what they simulate (s, K), relative to how fast and wide each beat is."""
    measured = model.measured.reshape(len(model.trials), -1)
    rows = simulated.reshape(len(points), *measured.shape)
    speed = (rows[..., SPEED] - measured[..., SPEED]) / np.maximum(np.abs(measured[..., SPEED]), 1e-3)
    wave = np.linalg.norm(rows[..., 1:] - measured[..., 1:], axis=-1) / np.linalg.norm(measured[..., 1:], axis=-1)
    misfit = np.nan_to_num((speed**2 + wave**2).sum(axis=-1), nan=np.inf)
    order = [i for i in np.argsort(misfit)[: _TRIED * starts] if np.isfinite(misfit[i])]
    forward = model.swim_forward(points[order])
    return [points[i] for i in [*np.array(order)[forward], *np.array(order)[~forward]][:starts]]
