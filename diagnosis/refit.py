"""Refit of the twin with effects: with named ones by Gauss-Newton, with all at once by ridge regression.

`refit_effects` starts from the strengths at which the linear responses of named effects fit the residual, and
`refit_from` steps on from there.

`ridge_fit` is for the twin of a robot with many small effects at once. Two swims seldom say which of many small effects
there are; their sum may be determined all the same, and it is this that moves the fish. So no effect is named here:
every parameter of the catalogue is normal about zero, as wide as its prior or narrower, all by one share, which the
evidence of the fitted swims chooses in addition to a gap of no particular cause (ridge regression, Hoerl and Kennard
1970; its width by evidence, MacKay 1992); effects that are named keep their freedom about their fitted values. The
evidence is linear about the twin with these, from features alone: how often a tail beats is a datum of its own.
Held-out swims tell whether all that forecasts better.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.special import logsumexp

from diagnosis.constants import CALLED_FOR, SHARES, WIDER
from diagnosis.evidence import Hypotheses
from diagnosis.linear_model import LinearModel
from fitting.affected_trials import AffectedSession
from fitting.mode import broyden
from fitting.signatures import LONG, PRIOR_SD, Signature, little
from swimcal.effects.effect import Effect, Parameter
from swimcal.mjcf import COEFFICIENT_BOUNDS

# Refit
_ROOT_STEP = 0.02  # finite difference of the square root of a coefficient
_STEP_SD = 0.25  # finite difference of a parameter, in standard deviations of its prior
_HALVINGS = (1.0, 0.5, 0.2)  # shares of a step that are tried
_TINY = 1e-9  # values of effects below this count as none
_MANY = 50  # numbers from which one step says too little to update the Jacobian
_RIDGE = 0.2  # ridge on the first strengths: slopes of strong effects are rough

# Ridge over all effects
_NONE = 1e-3  # share of the priors' widths that stands for no effect but the named ones
_LOOKS = 4  # rounds in which parameters with the wrong sign are set to zero
_GAPS_M = np.geomspace(1e-4, 0.03, 12)  # sizes of the gap of no particular cause


@dataclass(frozen=True, eq=False)
class Refit:
    """The refitted twin with effects.

    Attributes:
        effects: the effects, with the parameters that these markers give them.
        at: (5,) coefficients.
        values: (p,) of all effects, one after the other.
        residual: (k,) residual of the fitted swims.
        covariance: (5 + p, 5 + p) of coefficients and values.
        taken: (5 + p,) standard deviations of the prior with which it was fitted.
        slopes: (k, 5 + p) Jacobian of the simulated row there.
    """

    effects: tuple[Effect, ...]
    at: np.ndarray
    values: np.ndarray
    residual: np.ndarray
    covariance: np.ndarray
    taken: np.ndarray
    slopes: np.ndarray

    @classmethod
    def plain(cls, linear: LinearModel) -> "Refit":
        """Return the recommended twin, without any effect."""
        return cls(
            (), linear.at, np.zeros(0), linear.residual, linear.coefficient_covariance, linear.prior_sd, linear.slopes
        )

    def precision(self, width: np.ndarray) -> np.ndarray:
        """Return the precision (5 + p, 5 + p) of coefficients and values under a prior of other widths (5 + p,)."""
        return np.asarray(np.linalg.inv(self.covariance) - np.diag(self.taken**-2.0) + np.diag(width**-2.0))

    @property
    def bounds(self) -> np.ndarray:
        """Lowest and highest coefficients and values, (2, 5 + p)."""
        return _bounds(self.effects)

    @property
    def parameters(self) -> list[tuple[str, Parameter, float]]:
        """The name of its effect, each parameter, and its value."""
        every = [(effect.name, parameter) for effect in self.effects for parameter in effect.parameters]
        return [(*each, float(value)) for each, value in zip(every, self.values, strict=True)]

    @property
    def width(self) -> np.ndarray:
        """Prior standard deviation (p,) of each value, wider where its effect is stronger, by one factor for each."""
        found = [np.zeros(0)]
        for effect in self.effects:
            sd = np.array([parameter.sd for parameter in effect.parameters])
            found.append(sd * max(1.0, float(np.sqrt(np.mean((self.by_effect[effect.name] / sd) ** 2)))))
        return np.concatenate(found)

    @property
    def by_effect(self) -> dict[str, np.ndarray]:
        """Values (p,) of each effect."""
        ends = np.cumsum([len(effect.parameters) for effect in self.effects])[:-1]
        parts = np.split(self.values, ends) if self.effects else []
        return {e.name: part for e, part in zip(self.effects, parts, strict=True)}


def refit_effects(linear: LinearModel, hypotheses: Hypotheses, effects: Sequence[Effect], rounds: int) -> Refit:
    """Refit the twin with effects, from the strengths at which their linear responses fit the residual.

    Args:
        linear: the linearised model of the fitted swims.
        hypotheses: its hypotheses, with the responses.
        effects: the effects.
        rounds: steps at most.
    """
    names = [each.name for each in hypotheses.effects]
    chosen = [hypotheses.best[names.index(effect.name)] for effect in effects]
    forms = [form for form in chosen if form is not None]
    assert len(forms) == len(effects), "an effect that does nothing explains nothing"
    columns = np.hstack([form.columns for form in forms])
    held = _RIDGE * np.eye(columns.shape[1])
    target = np.append(linear.space.projected(linear.residual), np.zeros(len(held)))
    strength = np.linalg.lstsq(np.vstack([columns, held]), target, rcond=None)[0]
    ends, start = np.cumsum([len(form.sd) for form in forms])[:-1], []
    for effect, form, own in zip(effects, forms, np.split(strength, ends), strict=True):
        values = np.zeros(len(effect.suited(linear.twin.robot, linear.trials[0].markers).parameters))
        values[list(form.parameters)] = np.clip(own, form.low, form.high) * form.sd
        start.append(values)
    return refit_from(linear, effects, np.concatenate(start), rounds)


def refit_from(
    linear: LinearModel,
    effects: Sequence[Effect],
    start: np.ndarray,
    rounds: int = 3,
    width: np.ndarray | None = None,
    slopes: np.ndarray | None = None,
) -> Refit:
    """Refit the twin with effects by Gauss-Newton steps, each shortened until it helps.

    After short steps the Jacobian is updated, not simulated; with many numbers the whole Jacobian is simulated anew
    after every step. The residual before a step counts as disturbance in it, of whatever cause: at first all that the
    plain twin leaves, then what the effects have not explained.

    Args:
        linear: the linearised model of the fitted swims.
        effects: the effects that act.
        start: (p,) values of all of them.
        rounds: steps at most.
        width: (p,) standard deviations of the prior of each value; by default wider than its own.
        slopes: (k, 5 + p) Jacobian of the simulated row to begin with; by default simulated at the start.
    """
    joint = _Joint(linear, effects, width)
    point = np.concatenate([linear.at, np.clip(start, joint.low[5:], joint.high[5:])])
    residual, misfit = joint.look(point)
    while not np.isfinite(misfit) and np.abs(point[5:]).max(initial=0.0) > _TINY:
        point[5:] /= 2  # towards the plain twin, which does not diverge
        residual, misfit = joint.look(point)
    given, slopes = slopes is not None, joint.slopes(point) if slopes is None else slopes
    for _ in range(rounds):
        misfit = joint.count_as_disturbance(residual, point)
        step = joint.step(point, residual, slopes)
        tried = [np.clip(point + share * step, joint.low, joint.high) for share in _HALVINGS]
        looks = joint.looks(np.array(tried))
        best = min(range(len(tried)), key=lambda i: looks[i][1])
        if not looks[best][1] < misfit - 0.01:
            if not given:
                break
            given, slopes = False, joint.slopes(point)
            continue
        given = False
        taken, change = tried[best] - point, residual - looks[best][0]
        point, (residual, misfit) = tried[best], looks[best]
        short = len(point) < _MANY and joint.moved(taken, slopes) <= LONG
        slopes = broyden(slopes, taken, change, taken * joint.sd**-2.0) if short else joint.slopes(point)
    joint.count_as_disturbance(residual, point)
    return Refit(joint.effects, point[:5], point[5:], residual, joint.covariance(slopes), joint.sd, slopes)


def residual_with(linear: LinearModel, best: Refit) -> np.ndarray:
    """Return the residual (k,) of other swims with a refitted twin; nan where it diverged."""
    return _Joint(linear, best.effects).rows(np.append(best.at, best.values)[None])[0]


def residual_drawn(linear: LinearModel, best: Refit, residual: np.ndarray, draws: int, seed: int) -> np.ndarray:
    """Return residuals (d, k) under draws of a refitted twin's numbers, linear about its residual (k,).

    All are nan where the twin diverges next to it.

    Args:
        linear: the linearised model of the swims.
        best: the refitted twin.
        residual: (k,) its residual.
        draws: number of draws.
        seed: seed of the draws.
    """
    joint, point = _Joint(linear, best.effects), np.append(best.at, best.values)
    drawn = np.random.default_rng([seed, 19]).multivariate_normal(point, best.covariance, draws)
    return residual - (np.clip(drawn, joint.low, joint.high) - point) @ joint.differences(point).T


def _bounds(effects: Sequence[Effect]) -> np.ndarray:
    """Return the lowest and highest coefficients and values of effects, (2, 5 + p)."""
    parameters = [(each.low, each.high) for effect in effects for each in effect.parameters]
    return np.array([COEFFICIENT_BOUNDS] * 5 + parameters, float).T


class _Joint:
    """Swims and the twin with effects, at points (5 + p,) of coefficients and values."""

    def __init__(self, linear: LinearModel, effects: Sequence[Effect], width: np.ndarray | None = None) -> None:
        self.session = AffectedSession.of(effects, linear.model, linear.camera, linear.at)
        self.effects = self.session.effects
        self.linear = linear
        parameters = [parameter for effect in self.effects for parameter in effect.parameters]
        own = np.array([parameter.sd for parameter in parameters])
        self.sd = np.append(linear.prior_sd, WIDER * own if width is None else width)
        self._step_sd = _STEP_SD * own
        self.mean = np.concatenate([linear.at, np.zeros(len(parameters))])
        self.low, self.high = _bounds(self.effects)
        self._root = linear.with_gap.root

    def rows(self, points: np.ndarray) -> np.ndarray:
        """Return the residuals (s, k), measured less simulated, at points (s, 5 + p)."""
        at, values = points[:, :5], points[:, 5:]
        measured = self.linear.model.measured
        expected = measured - self.linear.foretold[: len(measured)]
        beside = self.linear.residual[len(measured) :] - self.session.beside(values)
        return np.hstack([expected - self.session.features(at, values), beside])

    def count_as_disturbance(self, residual: np.ndarray, point: np.ndarray) -> float:
        """Set the size of a gap of no particular cause by the residual (k,) at a point, and return the misfit there."""
        self._root = self.linear.with_gap_in(residual).root
        white = self._white(residual)
        return float(white @ white) + self.priors(point)

    def looks(self, points: np.ndarray) -> list[tuple[np.ndarray, float]]:
        """Return the residual and the misfit at each point; the misfit is infinite where the twin diverged."""
        found = []
        for point, row in zip(points, self.rows(points), strict=True):
            white = self._white(row) if np.isfinite(row).all() else np.array([np.inf])
            found.append((row, float(white @ white) + self.priors(point)))
        return found

    def look(self, point: np.ndarray) -> tuple[np.ndarray, float]:
        """Return the residual and the misfit at one point."""
        return self.looks(point[None])[0]

    def priors(self, point: np.ndarray) -> float:
        """Return the squared distance of a point from the prior means, in standard deviations."""
        return float((((point - self.mean) / self.sd) ** 2).sum())

    def slopes(self, point: np.ndarray) -> np.ndarray:
        """Return the Jacobian (k, 5 + p) of the twin's row, central where bounds allow it; 0 where it diverged."""
        return np.nan_to_num(self.differences(point))

    def differences(self, point: np.ndarray) -> np.ndarray:
        """Return the same Jacobian, nan where the twin diverged; for many numbers one-sided, on the wider side."""
        steps = np.concatenate([_ROOT_STEP * 2 * np.sqrt(np.maximum(point[:5], 0.01)), self._step_sd])
        up, down = (np.clip(point + sign * np.diag(steps), self.low, self.high) for sign in (1, -1))
        if len(point) >= _MANY:
            moved = np.where(np.diag(up) - point >= point - np.diag(down), up.T, down.T).T
            rows = self.rows(np.vstack([moved, point]))
            return np.asarray(((rows[-1] - rows[:-1]) / (np.diag(moved) - point)[:, None]).T)
        rows = self.rows(np.vstack([up, down]))
        width = np.diag(up - down)
        return np.asarray(((rows[len(point) :] - rows[: len(point)]) / width[:, None]).T)

    def step(self, point: np.ndarray, residual: np.ndarray, slopes: np.ndarray) -> np.ndarray:
        """Return the Gauss-Newton step (5 + p,) towards the optimum."""
        white, columns = self._white(residual), self._white(slopes)
        information = columns.T @ columns + np.diag(self.sd**-2.0)
        return np.asarray(np.linalg.solve(information, columns.T @ white - (point - self.mean) / self.sd**2))

    def moved(self, step: np.ndarray, slopes: np.ndarray) -> float:
        """Return how far a step (5 + p,) moves the row, together with its distance in the prior."""
        return float(np.hypot(np.linalg.norm(self._white(slopes @ step)), np.linalg.norm(step / self.sd)))

    def covariance(self, slopes: np.ndarray) -> np.ndarray:
        """Return the covariance (5 + p, 5 + p) of coefficients and values."""
        columns = self._white(slopes)
        return np.asarray(np.linalg.inv(columns.T @ columns + np.diag(self.sd**-2.0)))

    def _white(self, rows: np.ndarray) -> np.ndarray:
        return np.asarray(solve_triangular(self._root, rows, lower=True))


# All effects at once.


class RidgeFit(NamedTuple):
    """Ridge fit: the twin with all effects, the likeliest share of the priors' widths, and the log evidence gained."""

    share: float
    gained: float
    refit: Refit

    @property
    def strengths(self) -> dict[tuple[str, str], float]:
        """Strength of each parameter of each effect, in standard deviations of its prior."""
        return {(name, each.name): value / each.sd for name, each, value in self.refit.parameters}

    @property
    def at_bound(self) -> tuple[tuple[str, str], ...]:
        """Parameters that are at a bound."""
        ends = ((name, each, value, (each.low, each.high)) for name, each, value in self.refit.parameters)
        return tuple((name, each.name) for name, each, value, both in ends if value != 0.0 and value in both)


def ridge_fit(
    linear: LinearModel, signatures: Sequence[Signature], effects: Mapping[str, Effect], named: Refit, rounds: int
) -> RidgeFit | None:
    """Fit all effects at once; None where the swims do not clearly support more than is named.

    Args:
        linear: the linearised model of the fitted swims.
        signatures: what each effect does.
        effects: the catalogue, by name.
        named: the twin with the named effects.
        rounds: steps of the refit at most.
    """
    standing = [each for each in signatures if _slopes(each) is not None]
    share, gained = likeliest_share(linear, standing, named)
    if share == _NONE or gained < CALLED_FOR:
        return None
    suited, by_name = [each.effect for each in standing], named.by_effect
    start = np.concatenate([by_name.get(e.name, np.zeros(len(e.parameters))) for e in suited])
    width = _widths(suited, named, share)
    slopes = _columns(linear, standing)
    return RidgeFit(share, gained, refit_from(linear, [effects[e.name] for e in suited], start, rounds, width, slopes))


def likeliest_share(linear: LinearModel, signatures: Sequence[Signature], named: Refit) -> tuple[float, float]:
    """Return the likeliest share of their priors' widths that unnamed effects have, and its log evidence gained.

    Args:
        linear: the linearised model of the fitted swims.
        signatures: what each effect does.
        named: the twin with the named effects.
    """
    effects, features = [each.effect for each in signatures], slice(None, len(linear.model.measured))
    columns, residual = _columns(linear, signatures)[features], named.residual[features]
    known, generic = linear.covariance[features, features], linear.generic[features, features]
    ridges = [_Ridge.of(known + size**2 * generic, columns, residual) for size in _GAPS_M]
    sides = np.append(np.zeros(len(PRIOR_SD)), _sides(effects, named))
    shares = (_NONE, *SHARES)
    widths = [np.append(PRIOR_SD, _widths(effects, named, share)) for share in shares]
    logs = [logsumexp([ridge.log_evidence(width, sides) for ridge in ridges]) for width in widths]
    return shares[int(np.argmax(logs))], float(logsumexp(logs[1:]) - np.log(len(SHARES)) - logs[0])


class _Ridge(NamedTuple):
    """Normal equations of columns (k, p), whitened: products (p, p) and (p,), squares of the residual, log volume."""

    gram: np.ndarray
    along: np.ndarray
    squares: float
    volume: float

    @classmethod
    def of(cls, covariance: np.ndarray, columns: np.ndarray, residual: np.ndarray) -> "_Ridge":
        """Build the normal equations from a covariance (k, k), columns (k, p) and a residual (k,)."""
        known = cho_factor(covariance, lower=True)
        solved = cho_solve(known, np.column_stack([columns, residual]))
        volume = float(np.log(np.diag(known[0])).sum())
        return cls(columns.T @ solved[:, :-1], columns.T @ solved[:, -1], float(residual @ solved[:, -1]), volume)

    def log_evidence(self, sd: np.ndarray, sides: np.ndarray) -> float:
        """Return the log evidence for strengths normal about zero, of standard deviations (p,), up to a constant.

        A strength of one sign only (`sides` 1 or -1) that would have the other is set to zero.
        """
        stands = np.ones(len(sd), bool)
        for _ in range(_LOOKS):
            along, gram = (sd * self.along)[stands], sd[stands, None] * self.gram[np.ix_(stands, stands)] * sd[stands]
            inner = np.eye(len(gram)) + gram
            strength = np.linalg.solve(inner, along)
            wrong = np.flatnonzero(stands)[strength * sides[stands] < 0]
            if not len(wrong):
                break
            stands[wrong] = False
        return float(-0.5 * (self.squares - along @ strength + np.linalg.slogdet(inner)[1]) - self.volume)


def _columns(linear: LinearModel, signatures: Sequence[Signature]) -> np.ndarray:
    """Return the Jacobian (k, 5 + p) of the row by coefficients and by small strengths of effects."""
    rows = [own for own in map(_slopes, signatures) if own is not None]
    assert len(rows) == len(signatures), "an effect that makes the twin diverge is in no twin"
    return np.vstack([linear.slopes.T, *rows]).T


def _slopes(signature: Signature) -> np.ndarray | None:
    """Return the Jacobian (p, k) by small strengths; None where the twin diverged at all strengths of a parameter."""
    slopes = [little(signature, number) for number in range(len(signature.effect.parameters))]
    rows = [slope for slope in slopes if slope is not None]
    return np.reshape(rows, (-1, signature.rows.shape[1])) if len(rows) == len(slopes) else None


def _sides(effects: Sequence[Effect], named: Refit) -> np.ndarray:
    """Return the sign (p,) of parameters of one sign; 0 for others and for named ones, which may have either."""
    signs = [
        0 if effect.name in named.by_effect else int(parameter.high > 0) - int(parameter.low < 0)
        for effect in effects
        for parameter in effect.parameters
    ]
    return np.array(signs)


def _widths(effects: Sequence[Effect], named: Refit, share: float) -> np.ndarray:
    """Return the standard deviations (p,) of all parameters."""
    shares = {effect.name: WIDER if effect.name in named.by_effect else share for effect in effects}
    return np.array([shares[effect.name] * parameter.sd for effect in effects for parameter in effect.parameters])
