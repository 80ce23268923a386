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
from fitting.model.trial_model import TrialModel, freedoms_together, simulated_together
from fitting.model.variance import COEFFICIENT_SD, FORECAST_SPEED, MEDIANS, Block, Covariance
from fitting.objective import COEFFICIENT_BOUNDS
from session.errors import SimulationDiverged
from swimmer import PUBLISHED_COEFFICIENTS

Progress = Callable[[str, float | None], None]
_SCREENED = 48
_TRIED = 4  # times the starts, of which it is asked whether their twins swim forward from rest
_ROUNDS = 14
_RENEWED = (0, 2, 5)  # rounds in which nuisances are simulated anew where the coefficients now are
_NATURALS = tuple(np.linspace(-0.8, 0.8, 9))  # of rolls to begin with, see `Roll.natural`
_ROOT_STEP = 0.08  # of the differences, in roots of coefficients: Kutta lift roughens the twin below that
_SHARES = (1.0, 0.5, 0.25, 0.1)  # of a step
_STILL = 0.2  # length of a step in standard deviations of the coefficients, below which it is the last
_APART = 1.0  # square root of the mean squared distance, in standard deviations, from which two ends differ
_AS_LIKELY = 2.0  # log density within which two ends are as likely


class End(NamedTuple):
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
    ends: tuple[End, ...]
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
    def disagree(self) -> tuple[End, ...]:
        """Ends as likely as the best, and elsewhere."""
        sd = np.sqrt(np.diag(self.coefficient_covariance))
        best = self.ends[0]

        def apart(end: End) -> bool:
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
    found: list[Mode] = []
    for number, start in enumerate(_promising(model, points, simulated, starts)):
        tell("fitting the coefficients", number / starts)
        if (each := _Descent(model, start).run()) is not None:
            found.append(each)
    if not found:
        raise SimulationDiverged("the twin diverged from every start; look into the flags of the fit trials")
    found.sort(key=lambda each: (not each.ends[0].forward, -each.ends[0].log_density))
    spent = len(points) + sum(each.simulations for each in found)
    return replace(found[0], ends=tuple(each.ends[0] for each in found), simulations=spent)


def mode_at(
    model: SessionModel,
    coefficients: np.ndarray,
    sizes: Mapping[str, float],
    roll: Roll = NO_ROLL,
    ends: tuple[End, ...] = (),
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
    """From one start."""

    def __init__(self, model: SessionModel, start: np.ndarray) -> None:
        self.model, self.start, self.simulated = model, start, 0
        self.forward = model.swim_forward(start[None])[0]

    def run(self) -> Mode | None:
        """None where the twin diverges on the way."""
        try:
            return self._run()
        except (np.linalg.LinAlgError, ValueError):  # what is simulated is not finite
            return None

    def _run(self) -> Mode:
        at, sizes, converged = self.start, dict(MEDIANS), False
        for round_ in range(_ROUNDS):
            if round_ in _RENEWED:
                blocks = blocks_at(self.model, at)
                covariance = Covariance.of(blocks)
                self.simulated += 16
            residual = self._residual(at)
            jacobian = jacobian_at(self.model.trials, at)
            sizes, deviance = covariance.restricted(residual, jacobian, sizes)
            deviance += self.model.trials[0].roll.deviance
            if converged:
                break
            self.simulated += 14
            others = covariance.without_roll(sizes) + _free(jacobian)
            if round_ in _RENEWED:
                self._start_roll(at, others)
                residual = self._residual(at)
            rolled, covariance = self._roll(at, residual, covariance, others)
            residual = self._residual(at)
            before, at = at, self._stepped(at, residual, jacobian, covariance.at(sizes))
            root = np.linalg.cholesky(np.linalg.inv(_coefficient_covariance(covariance.at(sizes), jacobian)))
            moved = np.hypot(np.linalg.norm(root.T @ (at - before)), rolled)
            converged = bool(moved < _STILL) and round_ >= _RENEWED[1]
        if not converged:  # the last step has not been looked at yet
            residual, jacobian = self._residual(at), jacobian_at(self.model.trials, at)
        end = End(self.start, at, -deviance, converged, bool(self.forward))
        return Mode(self.model, at, sizes, covariance, blocks, residual, jacobian, (end,), self.simulated)

    def _start_roll(self, at: np.ndarray, total: np.ndarray) -> None:
        """Begins with the likeliest roll of a few natural frequencies, in a covariance (K, K) of all else.

        Near its natural frequency a roll turns round, so that a wrong one asks for the wrong sign.
        """
        trials = self.model.trials
        told = [trial.trajectories(at[None]) for trial in trials]

        def row(roll: Roll) -> np.ndarray:
            own = zip(trials, told, strict=True)
            return np.concatenate([trial.rolling(roll).features_of(each)[0] for trial, each in own])

        without = row(NO_ROLL)
        factor = cho_factor(total, lower=True)
        found: list[tuple[float, Roll]] = []
        for natural in _NATURALS:
            column = row(Roll(ROLL_SD[0], natural)) - without
            pull = column @ cho_solve(factor, self.model.measured - without)
            information = column @ cho_solve(factor, column) + 1.0
            roll = NO_ROLL.moved(np.array([pull / information, natural / ROLL_SD[1]]))
            found.append((0.5 * pull**2 / information - 0.5 * (natural / ROLL_SD[1]) ** 2, roll))
        self.model = self.model.rolling(max(found)[1])

    def _roll(
        self, at: np.ndarray, residual: np.ndarray, covariance: Covariance, total: np.ndarray
    ) -> tuple[float, Covariance]:
        """Goes on to the likeliest roll, linear, in a covariance (K, K) of all else.

        Returns:
            The way in standard deviations, and the covariance with what the roll does now.
        """
        roll = self.model.trials[0].roll
        rolls = np.vstack([each.rolls_at(at) for each in self.model.trials])
        factor = cho_factor(total, lower=True)
        information = rolls.T @ cho_solve(factor, rolls) + np.eye(2)
        pull = rolls.T @ cho_solve(factor, residual) - np.array(roll) / ROLL_SD
        there = roll.moved(np.linalg.solve(information, pull))
        self.model = self.model.rolling(there)
        step = (np.array(there) - np.array(roll)) / ROLL_SD
        return float(np.sqrt(step @ information @ step)), replace(covariance, rolls=rolls)

    def _residual(self, at: np.ndarray) -> np.ndarray:
        return self.model.measured - self.model.simulated(at[None])[0]

    def _stepped(self, at: np.ndarray, residual: np.ndarray, jacobian: np.ndarray, total: np.ndarray) -> np.ndarray:
        """(5,) one step on, or the same where no share of it gains. A twin that swims forward from rest goes on to."""
        root = np.linalg.cholesky(total)
        white, columns = (solve_triangular(root, each, lower=True) for each in (residual, jacobian))
        low, high = COEFFICIENT_BOUNDS
        step = lsq_linear(columns, white, bounds=(low - at - 1e-9, high - at + 1e-9)).x
        tried = np.clip(at + np.outer(_SHARES, step), low, high)
        residuals = self.model.measured - self.model.simulated(tried)
        self.simulated += len(tried)
        squares = [
            float((solve_triangular(root, row, lower=True) ** 2).sum()) if np.isfinite(row).all() else np.inf
            for row in residuals
        ]
        allowed = self.model.swim_forward(tried) if self.forward else np.ones(len(tried), bool)
        best = int(np.argmin(np.where(allowed, squares, np.inf)))
        return np.asarray(tried[best] if allowed[best] and squares[best] < white @ white else at)


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
