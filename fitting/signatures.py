"""Signatures of effects: how what a session measured would change with an effect.

What a session measured is one row: the features of all swims, then the differences of their frequencies from the
commands, how fast markers slide aside of their neighbours, and the numbers of free decays (`residual_row`,
`row_slopes`, `row_covariance`). In the space `Whitened` all that disturbs a row has unit size.
`fitting.affected_trials` has the twins behind it.

A `Signature` is the change of the row at a few strengths of an effect. The change over the strength, the slope of a
chord, is taken to be right about that strength (`pieces`). Nearer to zero the slope goes on as it changes from the
other side of zero, or, for a parameter with one sign, as it changes beyond; where it changes only across zero it has a
kink there, and stays.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from fitting.affected_trials import AffectedSession, plain_features
from fitting.covariance import COEFFICIENT_SD, apart
from fitting.session_model import SessionModel
from fitting.trial import MeasuredTrial
from swimcal.effects.effect import Effect
from swimcal.mjcf import COEFFICIENT_BOUNDS
from swimcal.session_file import CameraSpec

# Rows
PRIOR_SD = np.full(5, COEFFICIENT_SD)
TOLD_TO = 0.002  # relative standard deviation of a measured frequency about the commanded one
_ALIKE = 0.8  # correlation of the errors of tail and motor's log: both do what the motor does
_LEAST = 0.01  # least coefficient for the Jacobian: nearer to 0 steps are lost in the twin's roughness
_STEP = 0.02  # finite difference of the root of a coefficient, either way
LONG = 10.0
"""Whitened norm of a step after which the Jacobian is simulated anew."""

# Signatures
STRENGTHS = (-3.0, -1.0, 1.0, 3.0)  # standard deviations of a parameter's prior
_LITTLE = 0.3  # share of the least strength tried at which the slope of small strengths is taken


# The row, and the space in which its disturbances have unit size.


def residual_row(model: SessionModel, at: np.ndarray) -> np.ndarray:
    """Return the residual (k + b,) of the features, and of the numbers after them.

    The residual of frequencies is their difference from the commands, Hz: first those of all tails, as filmed, then
    those of the motors that were logged. Then come the speeds at which markers slide aside, and free decays.

    Args:
        model: the session.
        at: (5,) coefficients of the twin.
    """
    residual = model.measured - model.simulated(at[None])[0]
    trials = [each.trial for each in model.trials]
    hertz = [0.0 if trial.commanded_hz is None else trial.filmed_hz - trial.commanded_hz for trial in trials]
    logged = [_off_command(trials[number]) for number in model.logged]
    return np.concatenate([residual, hertz, logged, model.measured_creeps, *(ring.residual for ring in model.rings)])


def row_slopes(model: SessionModel, at: np.ndarray) -> np.ndarray:
    """Return the Jacobian (k + b, 5) of the row by the coefficients, on which only features depend.

    Its steps are even in the roots of the coefficients. Where a trial's twin diverges a step to one side, the other
    side tells; where to both, the coefficient has no effect on that trial.

    Args:
        model: the session.
        at: (5,) coefficients of the twin.
    """
    roots = np.sqrt(np.maximum(at, _LEAST)) + _STEP * np.vstack([np.eye(5), -np.eye(5)])
    points = np.clip(roots, 0.0, np.sqrt(COEFFICIENT_BOUNDS[1])) ** 2
    features = model.simulated(np.vstack([points, at]))
    up, down, middle = features[:5], features[5:10], features[10]
    up, down = np.where(np.isfinite(up), up, 2 * middle - down), np.where(np.isfinite(down), down, 2 * middle - up)
    slopes = np.nan_to_num(up - down) / np.diag(points[:5] - points[5:])[:, None]
    return np.vstack([slopes.T, np.zeros((model.beside, 5))])


def row_covariance(model: SessionModel, features: np.ndarray, robot: np.ndarray | None = None) -> np.ndarray:
    """Return the covariance (k + b, k + b) of a row; frequencies are as far off their commands as motors are.

    Args:
        model: the swims.
        features: (k, k) covariance of all that disturbs them.
        robot: (k, q) effect of the robot's uncertain numbers on features, which decays have in common with them;
            default: nothing.
    """
    whose = [*range(len(model.trials)), *model.logged]
    hertz = np.diag([TOLD_TO * model.trials[number].trial.frequency.hz for number in whose])
    correlation = np.where(np.equal.outer(whose, whose), _ALIKE, 0.0) + (1 - _ALIKE) * np.eye(len(whose))
    doubted = model.ring_sensitivities
    told = apart(features, model.observed)
    of_tracks = np.diag(np.concatenate([np.zeros(0), *(ring.sd for ring in model.rings)]) ** 2)
    creeps = apart(model.covariance_of_creeps, model.creeps_observed)
    whole = block_diag(told, hertz @ correlation @ hertz, creeps, of_tracks + doubted @ doubted.T)
    if robot is not None and robot.shape[1] == doubted.shape[1]:  # else it is not doubted yet
        shared = robot @ doubted.T
        whole[: len(features), len(whole) - len(doubted) :] = shared
        whole[len(whole) - len(doubted) :, : len(features)] = shared.T
    return np.asarray(whole)


@dataclass(frozen=True, eq=False)
class Whitened:
    """A space in which all that disturbs a session's row of k numbers has unit size and coefficients are free.

    The row holds the features of t trials, and then the numbers after them.

    Attributes:
        root: (k, k) lower Cholesky factor of the covariance of noise, nuisances and the twin's own discrepancy.
        slopes: (k, 5) Jacobian of the row by the coefficients.
        precision: (5,) precision of the prior of the coefficients.
    """

    root: np.ndarray
    slopes: np.ndarray
    precision: np.ndarray

    @classmethod
    def of(cls, covariance: np.ndarray, slopes: np.ndarray, prior_sd: np.ndarray) -> "Whitened":
        """Build the space.

        Args:
            covariance: (k, k) of the row.
            slopes: (k, 5) Jacobian of the row by the coefficients.
            prior_sd: (5,) standard deviations of the prior of the coefficients.
        """
        return cls(np.linalg.cholesky(covariance), slopes, prior_sd**-2.0)

    @cached_property
    def _whitening(self) -> np.ndarray:
        """Matrix (k, k) that whitens rows: the inverse of the root, transposed."""
        return solve_triangular(self.root, np.eye(len(self.root)), lower=True).T

    @cached_property
    def _projection(self) -> np.ndarray:
        """Matrix (k, k + 5) that whitens rows and takes out what coefficients can explain."""
        slopes = np.vstack([self._whitening.T @ self.slopes, np.diag(np.sqrt(self.precision))])
        white = np.hstack([self._whitening, np.zeros((len(self.root), len(self.precision)))])
        explained, _ = np.linalg.qr(slopes)
        return white - (white @ explained) @ explained.T

    def whitened(self, rows: np.ndarray) -> np.ndarray:
        """Return rows (..., k) whitened, of the same shape."""
        return np.asarray(rows @ self._whitening)

    def projected(self, rows: np.ndarray) -> np.ndarray:
        """Return rows (..., k) whitened, less what coefficients can explain, (..., k + 5); norms are distances."""
        return np.asarray(rows @ self._projection)

    @cached_property
    def log_volume(self) -> float:
        """Part of the logarithm of a row's density besides half the square of its norm, up to a constant."""
        white = solve_triangular(self.root, self.slopes, lower=True)
        freedom = np.diag(self.precision) + white.T @ white
        of_prior = 0.5 * float(np.log(self.precision).sum())
        return of_prior - float(np.log(np.diag(self.root)).sum()) - 0.5 * float(np.linalg.slogdet(freedom)[1])

    def coefficients(self, row: np.ndarray) -> np.ndarray:
        """Return the change (5,) of coefficients that best makes up for a change (k,) of the row.

        The prior holds it back.
        """
        white, slopes = (solve_triangular(self.root, part, lower=True) for part in (row, self.slopes))
        return np.linalg.solve(slopes.T @ slopes + np.diag(self.precision), slopes.T @ white)

    def length(self, row: np.ndarray) -> float:
        """Return the norm of a change (k,) of the row after coefficients are refitted."""
        return float(np.linalg.norm(self.projected(row)))


def _off_command(trial: MeasuredTrial) -> float:
    assert trial.logged_hz is not None
    assert trial.commanded_hz is not None
    return trial.logged_hz - trial.commanded_hz


# The signature of an effect.


@dataclass(frozen=True, eq=False)
class Signature:
    """Signature of one effect on trials whose features form a row of length k, followed by b further numbers.

    Attributes:
        effect: the effect, with the parameters that these trials' markers give it.
        values: (q, p) strengths that were tried.
        features: (q, k) change of the row of features; nan where the twin diverged.
        beside: (q, b) change of what the trials' commands lead to, as filmed and as logged, Hz, of how fast markers
            slide aside, m/s, and of how decays ring.
    """

    effect: Effect
    values: np.ndarray
    features: np.ndarray
    beside: np.ndarray

    @property
    def rows(self) -> np.ndarray:
        """Changes of the whole row, (q, k + b)."""
        return np.hstack([self.features, self.beside])


def signature_of(
    effect: Effect,
    model: SessionModel,
    camera: CameraSpec,
    coefficients: np.ndarray,
    values: np.ndarray | None = None,
) -> Signature:
    """Compute the signature of an effect on the trials of a session, against the plain twin.

    An effect of no strength is the plain twin (see `Effect`): one that is not would have a part that never changes.

    Args:
        effect: the effect, of the catalogue or of a user.
        model: the trials with the plain twin.
        camera: the camera that filmed them.
        coefficients: (5,) of the twin.
        values: (q, p) strengths; by default each parameter alone, one and three standard deviations of its prior either
            way, as far as its bounds allow.
    """
    session = AffectedSession.of([effect], model, camera, coefficients)
    suited = session.effects[0]
    values = strengths(suited) if values is None else values
    plain = plain_features(model, camera, tuple(map(float, coefficients)))
    rows = (
        session.features(np.tile(coefficients, (len(values), 1)), values) if len(values) else np.zeros((0, len(plain)))
    )
    return Signature(suited, values, rows - plain, session.beside(values))


def strengths(effect: Effect) -> np.ndarray:
    """Return the strengths to try (q, p): each parameter alone, in sizes `STRENGTHS` as far as its bounds allow."""
    rows = []
    for number, parameter in enumerate(effect.parameters):
        for size in STRENGTHS:
            value = float(np.clip(size * parameter.sd, parameter.low, parameter.high))
            if value != 0.0:
                rows.append(value * np.eye(len(effect.parameters))[number])
    return np.unique(rows, axis=0) if rows else np.zeros((0, len(effect.parameters)))


class Piece(NamedTuple):
    """Slope of an effect over one stretch of strengths.

    Attributes:
        low, high: ends of the stretch, of its sign or zero, in the unit of the parameter.
        slope: (k,) change of the row over the strength; m, m/s or Hz for one of that unit.
    """

    low: float
    high: float
    slope: np.ndarray


def pieces(signature: Signature, parameter: int) -> tuple[Piece, ...]:
    """Return the pieces of all strengths of one parameter that its bounds allow, the lowest first.

    There is none where the twin diverged at every strength.

    Args:
        signature: the signature.
        parameter: number of the parameter.
    """
    bounds = signature.effect.parameters[parameter]
    tried = _chord_slopes(signature, parameter)
    found: list[Piece] = []
    for sign, end in ((-1.0, bounds.low), (1.0, bounds.high)):
        own = {sign * value: slope for value, slope in tried.items() if sign * value > 0}
        other = {-sign * value: slope for value, slope in tried.items() if sign * value < 0}
        if sign * end <= 0:
            continue
        if own:
            side = _side(own, other, sign * end)
        elif other:  # it diverged on this side: as on the other
            side = [Piece(0.0, sign * end, _about_zero(other, own))]
        else:
            continue
        found += side if sign > 0 else [Piece(-piece.high, -piece.low, piece.slope) for piece in side]
    return tuple(sorted(found, key=lambda piece: piece.low))


def little(signature: Signature, parameter: int) -> np.ndarray | None:
    """Return the slope of small strengths (k,), averaged over both signs.

    Args:
        signature: the signature.
        parameter: number of the parameter.

    Returns:
        None where the twin diverged at every strength.
    """
    near = [piece.slope for piece in pieces(signature, parameter) if piece.low <= 0 <= piece.high]
    return np.asarray(np.mean(near, axis=0)) if near else None


def _side(own: dict[float, np.ndarray], other: dict[float, np.ndarray], end: float) -> list[Piece]:
    """Return the pieces of one side, strengths counted from zero."""
    sizes = sorted(own)
    slopes = [_about_zero(own, other), *(own[size] for size in sizes)]
    places = [_LITTLE * sizes[0], *sizes]
    edges = [0.0, *(min(float(np.sqrt(a * b)), end) for a, b in pairwise(places)), end]
    found = (Piece(low, high, slope) for (low, high), slope in zip(pairwise(edges), slopes, strict=True))
    return [piece for piece in found if piece.low < piece.high]


def _about_zero(own: dict[float, np.ndarray], other: dict[float, np.ndarray]) -> np.ndarray:
    """Return the slope of small strengths on one side, (k,)."""
    sizes = sorted(own)
    first = own[sizes[0]]
    beyond = own[sizes[1]] - first if len(sizes) > 1 else None
    way = (1 - _LITTLE) * sizes[0]
    if other:
        across = first - other[min(other)]
        if beyond is None:
            share = 1.0
        else:
            expected = float(np.linalg.norm(across)) * (sizes[1] - sizes[0]) / (sizes[0] + min(other))
            share = min(float(np.linalg.norm(beyond)) / max(expected, 1e-300), 1.0)
        return np.asarray(first - share * across * way / (sizes[0] + min(other)))
    if beyond is None:
        return first
    return np.asarray(first - beyond * way / (sizes[1] - sizes[0]))


def _chord_slopes(signature: Signature, parameter: int) -> dict[float, np.ndarray]:
    """Return the slope of each chord by strength, for this parameter alone, where the twin did not diverge."""
    found = {}
    for values, row in zip(signature.values, signature.rows, strict=True):
        strength = float(values[parameter])
        if strength and np.isfinite(row).all() and np.count_nonzero(values) == 1:
            found[strength] = row / strength
    return found
