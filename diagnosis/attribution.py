"""Which groups of effects the joint fit of all effects owes its held-out forecasts to, where names do not suffice.

A group is left out by projection: draws of the joint fit's normal posterior lose its parameters, and coefficients and
all other parameters move to make up for them in the fitted trials as well as they can, within what the fit leaves them
(projection onto a smaller model: Piironen and Vehtari 2017; here linear). The gain of every subset of groups on
held-out trials is shared out by Shapley's value (1953).
"""

from collections.abc import Mapping, Sequence
from itertools import combinations
from math import comb

import numpy as np
from scipy.linalg import solve_triangular

from diagnosis.linear_model import LinearModel
from diagnosis.refit import Refit, held_out_jacobian, residual_with
from diagnosis.result import Attribution, GroupShare
from fitting.model.features import SPEED
from swimmer.effects import Effect

GROUPS = ("camera and markers", "clock and drive", "tendons", "structure", "fluid and surroundings")
_DRAWS = 60
_COEFFICIENTS = 5

Subset = frozenset[str]


def group_of(effect: Effect) -> str:
    """The group that an effect belongs to."""
    if effect.stage == "camera":
        return "camera and markers"
    if effect.stage == "drive":
        return "clock and drive"
    return {"tendons": "tendons", "structure": "structure"}.get(effect.family, "fluid and surroundings")


def attribute(linear: LinearModel, held_out: LinearModel, every: Refit, seed: int = 0) -> Attribution | None:
    """None where the twin diverges on a held-out trial or next to the joint fit.

    Args:
        linear: the fitted trials.
        beside: the held-out trials.
        every: the joint fit.
        seed: of the draws.
    """
    residual, jacobian = residual_with(held_out, every), held_out_jacobian(held_out, every)
    if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
        return None
    point = np.append(np.zeros(_COEFFICIENTS), every.values)
    draws = np.random.default_rng([seed, 37]).multivariate_normal(np.zeros(len(point)), every.covariance, _DRAWS)
    draws = np.vstack([np.zeros(len(point)), draws])
    whose = [""] * _COEFFICIENTS
    whose += [group_of(effect) for effect in every.effects for _ in effect.parameters]
    present = tuple(group for group in GROUPS if group in whose)
    root = linear.with_gap_in(every.residual).root
    white = solve_triangular(root, every.slopes, lower=True)
    rows = {
        subset: residual - (draws + _moved(white, every.taken, np.array(whose), subset, point + draws)) @ jacobian.T
        for subset in subsets(present)
    }
    losses = {subset: _loss(held_out, each) for subset, each in rows.items()}  # (1 + d, t)
    speeds = {subset: _speed_errors(held_out, each) for subset, each in rows.items()}
    none, whole = frozenset[str](), frozenset(present)
    over = np.maximum(losses[none].mean(axis=1) - 1.0, 1e-9)
    gap = shapley({subset: (losses[none] - each).mean(axis=1) / over for subset, each in losses.items()}, present)
    speed = shapley({subset: (speeds[none] - each).mean(axis=1) for subset, each in speeds.items()}, present)
    shares = {name: GroupShare(*_told(gap[name]), *_told(speed[name])) for name in present}
    return Attribution(shares, smallest(losses, whole, GROUPS), smallest(speeds, whole, GROUPS))


def subsets(names: Sequence[str]) -> list[Subset]:
    """All of them, the smallest first."""
    return [frozenset(each) for size in range(len(names) + 1) for each in combinations(names, size)]


def shapley(values: Mapping[Subset, np.ndarray], names: Sequence[str]) -> dict[str, np.ndarray]:
    """The share of each name in values (d,) of all subsets of the names: its mean gain over all orders of joining."""
    count, found = len(names), {}
    for name in names:
        others = [other for other in names if other != name]
        gains = [
            (values[subset | {name}] - values[subset]) / (count * comb(count - 1, len(subset)))
            for subset in subsets(others)
        ]
        found[name] = np.sum(gains, axis=0)
    return found


def smallest(errors: Mapping[Subset, np.ndarray], whole: Subset, order: Sequence[str]) -> tuple[str, ...]:
    """The fewest names whose mean error over trials is within one standard error of that of all.

    Args:
        errors: (d, t) of t trials by the subset; the first row is that of the fit itself.
        whole: all names.
        order: in which they are reported.
    """
    best = errors[whole][0]
    found = []
    for subset, each in errors.items():
        worse = each[0] - best
        error = worse.std(ddof=1) / np.sqrt(len(worse)) if len(worse) > 1 else 0.0
        if worse.mean() <= error + 1e-12:
            found.append((len(subset), float(worse.mean()), tuple(name for name in order if name in subset)))
    return min(found)[2]


def _moved(white: np.ndarray, sd: np.ndarray, whose: np.ndarray, subset: Subset, points: np.ndarray) -> np.ndarray:
    """(d, q) by which draws (d, q) of all numbers move once those of groups outside a subset are none.

    Args:
        white: (k, q) Jacobian of the fitted trials, whitened.
        sd: (q,) of the prior beside which all were fitted.
        whose: (q,) the group of each number, "" of coefficients.
        subset: groups that stay.
        points: (d, q) numbers of effects.
    """
    stays = (whose == "") | np.isin(whose, list(subset))
    moved = np.where(stays, 0.0, -points)
    kept, lost = white[:, stays], points[:, ~stays] @ white[:, ~stays].T
    information = kept.T @ kept + np.diag(sd[stays] ** -2.0)
    moved[:, stays] = np.linalg.solve(information, kept.T @ lost.T).T
    return moved


def _loss(held_out: LinearModel, residual: np.ndarray) -> np.ndarray:
    """(d, t) mean squared whitened residual of each held-out trial."""
    squares, trial_of = held_out.whitened_swims(residual) ** 2, held_out.trial_of[held_out.scored]
    return np.column_stack([squares[:, trial_of == number].mean(axis=1) for number in range(len(held_out.swims))])


def _speed_errors(held_out: LinearModel, residual: np.ndarray) -> np.ndarray:
    """(d, t) absolute errors of the speed, m/s."""
    features = len(held_out.model.measured)
    each = residual[:, :features].reshape(len(residual), len(held_out.trials), -1)
    return np.abs(each[:, : len(held_out.swims), SPEED])


def _told(drawn: np.ndarray) -> tuple[float, tuple[float, float]]:
    """Of the fit itself, which comes first, and the interval over draws of it."""
    low, high = np.quantile(drawn[1:], [0.05, 0.95])
    return float(drawn[0]), (min(float(low), float(drawn[0])), max(float(high), float(drawn[0])))
