"""How far the data hold each coefficient: 95 % intervals from curvature and noise at the end of a fit.

The sandwich covariance of an M-estimator (Huber 1967), A^-1 B A^-1: A is the objective's curvature, B the covariance
of its gradient. The errors of neighbouring frames hang together, so B is summed over lags with a triangular window
(Newey and West 1987). All frames of a trial share one more error, that of the nose in the frame they are aligned at;
it is usually the larger part.
"""

import numpy as np

from fitting.objective import COEFFICIENT_BOUNDS
from fitting.search_space import ROOTS, SearchSpace

WINDOW_S = 0.5  # tracking errors last 3 to 17 frames at 60 a second on the public trials
LASTS_S = 0.1  # what the errors of the nose are taken to last, to tell them from slow errors of the twin
NORMAL_95 = 1.96


def covariance(space: SearchSpace, point: np.ndarray) -> np.ndarray:
    """(p, p) covariance of a point (p,) of the search space that minimises the objective.

    It holds for the valley the point lies in, as far as it is straight, and takes what the twin cannot follow for
    noise. Costs 2 p + 1 simulations of the trials.
    """
    errors = space.errors(point[:, None])
    slopes = space.slopes(point[:, None], errors)
    inverse = np.linalg.pinv(space.norm.curvature(errors, slopes), hermitian=True)
    return inverse @ _gradient_covariance(space, errors, slopes) @ inverse


def intervals(space: SearchSpace, point: np.ndarray) -> np.ndarray:
    """(5, 2) 95 % intervals of the coefficients at a point (p,), within their bounds: symmetric in their roots."""
    reach = NORMAL_95 * np.sqrt(np.diag(covariance(space, point))[:5])
    ends = np.clip(np.column_stack([point[:5] - reach, point[:5] + reach]), *ROOTS)
    return np.clip(ends**2, *COEFFICIENT_BOUNDS)


def _gradient_covariance(space: SearchSpace, errors: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """(p, p) covariance of the objective's gradient under the noise seen in the errors (2 e, 1)."""
    pull = space.norm.pull(errors)[:, None, None]  # (e, 1, 1)
    pairs, moved = errors.reshape(-1, 1, 2), slopes.reshape(-1, 2, space.size)
    score = (pull * pairs @ moved)[:, 0]  # (e, p)
    aligned = pull * moved  # (e, 2, p) by which the gradient follows the frame all others are aligned at
    total, first = np.zeros((space.size, space.size)), 0
    for trial in space.swims.trials:
        frame, marker = np.nonzero(trial.weight[trial.scored] > 0)
        rows = slice(first, first := first + len(frame))
        step_s = float(np.median(np.diff(trial.time_s)))
        by_frame = np.zeros((int(trial.scored.sum()), space.size))
        np.add.at(by_frame, frame, score[rows])
        total += _summed_over_lags(by_frame, round(WINDOW_S / step_s))
        if space.swims.comparison != "shape":
            nose = pairs[rows][marker == trial.markers.index("nose"), 0]  # (k, 2)
            offset = aligned[rows].sum(axis=0)  # (2, p)
            total += offset.T @ (_jitter_sq(nose, round(LASTS_S / 2 / step_s))[:, None] * offset)
    return total


def _jitter_sq(errors: np.ndarray, lag: int) -> np.ndarray:
    """(2,) variance of errors (k, 2) that last two lags (AR(1)), from their second differences over one lag each."""
    lag = min(max(lag, 1), (len(errors) - 1) // 2)
    bent = errors[2 * lag :] - 2 * errors[lag:-lag] + errors[: -2 * lag]
    return (bent**2).mean(axis=0) / (6 - 8 * np.exp(-0.5) + 2 * np.exp(-1))


def _summed_over_lags(score: np.ndarray, lags: int) -> np.ndarray:
    """(p, p) long-run covariance of a sum over frames (k, p)."""
    total = score.T @ score
    for lag in range(1, min(lags, len(score))):
        across = score[lag:].T @ score[:-lag]
        total += (1 - lag / lags) * (across + across.T)
    return total
