"""How far the gap shrinks on held-out swims once effects are added, both twins refitted on the fitted ones.

S = 1 - (L_with - F) / (L_plain - F), with L the mean squared whitened residual and F what noise alone would leave.

Its interval is that of the S which the true coefficients and strengths would have on these swims without noise. Noise
is taken off as a normal draw, whose size is known no better than it shows where nothing is wrong: the twin's own error
counts as noise here, and is not the same in every session. And coefficients and strengths that were fitted are moved
as far as they may be off. Whatever moves them makes a held-out gap larger, more often than not, and the truth made it
smaller: so their draws are reflected about what was found (Davison and Hinkley 1997, section 5.2).
"""

from dataclasses import dataclass

import numpy as np

from diagnosis.constants import CLEAR, FLOOR_SD, LEAST_GAP

_DRAWS = 4000


@dataclass(frozen=True)
class SkillScore:
    """Of one held-out gap.

    Attributes:
        plain, with_effects: mean squared whitened residual.
        value: S; None where the plain twin leaves no more than noise, or nothing was added.
        interval: 95 %, over trials, over their noise and how large it is, and over how far what was fitted may be off;
            None where S is, or where twins a little off what was fitted diverge. It holds S itself, and nothing above
            1 but that: what is left may be less than F makes it. Of one trial nothing is known of others.
    """

    plain: float
    with_effects: float
    value: float | None
    interval: tuple[float, float] | None


def skill_score(
    before: np.ndarray,
    after: np.ndarray | None,
    trial_of: np.ndarray,
    seed: int = 0,
    otherwise: tuple[np.ndarray, np.ndarray] | None = None,
) -> SkillScore:
    """Of whitened residuals (q,) of some trials beside the plain twin and one with effects.

    Args:
        before: of the plain twin.
        after: of the one with effects; None where no effect was added.
        trial_of: (q,) number of the trial that each is of.
        seed: of the draws.
        otherwise: (d, q) each, residuals of draws of the plain twin and of the one with effects, fitted as they might
            have been; default: that they are known.
    """
    count = len(before)
    plain = float(before @ before / count)
    if after is None:
        return SkillScore(plain, plain, None, None)
    over, under = before @ before - count, after @ after - count
    with_effects = float(after @ after / count)
    if over < CLEAR * np.sqrt(2 * count + 4 * max(over, 0.0)):
        return SkillScore(plain, with_effects, None, None)
    drawn_over, drawn_under = (
        excess - noise for excess, noise in zip((over, under), _noise(before, after, seed), strict=True)
    )
    value = float(1 - under / over)
    drawn = 1 - np.maximum(drawn_under, 0.0) / np.maximum(drawn_over, LEAST_GAP * over)
    if trial_of.max() > 0:
        drawn += value - _over_trials(before, after, trial_of, seed)
    if otherwise is not None:
        values = _values(*otherwise)
        if not len(values):
            return SkillScore(plain, with_effects, value, None)
        drawn = np.add.outer(value - values, drawn).ravel()
    low, high = np.quantile(np.minimum(drawn, 1.0), [0.025, 0.975])  # without noise nothing shrinks by more than all
    return SkillScore(plain, with_effects, value, (min(float(low), value), max(float(high), value)))


def _over_trials(before: np.ndarray, after: np.ndarray, trial_of: np.ndarray, seed: int) -> np.ndarray:
    """(d,) S of several trials drawn anew (Bayesian bootstrap; Rubin 1981)."""
    over, under = (np.bincount(trial_of, row**2 - 1) for row in (before, after))  # (t,)
    shares = np.random.default_rng([seed, 29]).dirichlet(np.ones(len(over)), _DRAWS)
    return np.asarray(1 - (shares @ under) / np.maximum(shares @ over, LEAST_GAP * over.mean()))


def _values(plain: np.ndarray, with_effects: np.ndarray) -> np.ndarray:
    """(d,) S of draws (d, q); those that diverged are left out, and there may be none."""
    standing = np.isfinite(plain).all(axis=1) & np.isfinite(with_effects).all(axis=1)
    over, under = ((rows[standing] ** 2).sum(axis=1) - rows.shape[1] for rows in (plain, with_effects))
    return np.asarray(1 - under / np.maximum(over, 1e-9))


def _noise(before: np.ndarray, after: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(d,) each, what noise adds to the squares of two rows (k,) that hold the same, beyond k.

    For each row twice the noise along what it is without, and the square of the noise.
    """
    count, random = len(before), np.random.default_rng([seed, 11])
    squares = np.maximum([before @ before - count, after @ after - count], 0.0)
    most = float(np.sqrt(squares.prod()))
    between = float(np.clip(before @ after - count, -most, most))
    along = random.multivariate_normal(np.zeros(2), [[squares[0], between], [between, squares[1]]], _DRAWS)
    size = np.exp(FLOOR_SD * random.standard_normal(_DRAWS) / 2)
    own = size**2 * random.chisquare(count, _DRAWS) - count
    return 2 * size * along[:, 0] + own, 2 * size * along[:, 1] + own
