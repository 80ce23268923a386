"""The mean distance as a norm for Gauss-Newton: robust, and smooth where distances vanish."""

import numpy as np
from mujoco.minimize import Norm

SOFTENING_M = 0.004  # below this distance the objective is quadratic, above it grows like the distance


class MeanDistance(Norm):
    """sum of w (sqrt(d^2 + s^2) - s) over weighted distances d: their mean, made smooth where they vanish.

    The curvature handed to Gauss-Newton is that of the reweighted quadratic that touches this function from above,
    so that a full step always descends (iteratively reweighted least squares; Weiszfeld 1937).

    Args:
        weight: (e,) of each error, adding up to 1.
    """

    def __init__(self, weight: np.ndarray) -> None:
        self._weight = weight

    def value(self, r: np.ndarray) -> np.float64:
        """The objective, m, for errors r (2 e, 1), m."""
        smooth = np.sqrt(self._distance_sq(r) + SOFTENING_M**2)
        return np.float64(self._weight @ (smooth - SOFTENING_M))

    def plain(self, r: np.ndarray) -> np.float64:
        """The mean distance itself, not softened, m, for errors r (2 e, 1), m."""
        return np.float64(self._weight @ np.sqrt(self._distance_sq(r)))

    def grad_hess(self, r: np.ndarray, proj: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gradient (p, 1) and curvature (p, p) after projection on proj (2 e, p)."""
        pull = np.repeat(self.pull(r), 2)[:, None]
        return proj.T @ (pull * r), proj.T @ (pull * proj)

    def pull(self, r: np.ndarray) -> np.ndarray:
        """(e,) by how much each error of r (2 e, 1) pulls: the gradient is the sum of pull times error, 1/m."""
        return self._weight / np.sqrt(self._distance_sq(r) + SOFTENING_M**2)

    def curvature(self, r: np.ndarray, proj: np.ndarray) -> np.ndarray:
        """(p, p) second derivative of the function itself, where r (2 e, 1) is linear with slopes proj (2 e, p)."""
        pull, slopes = self.pull(r), proj.reshape(len(r) // 2, 2, -1)
        along = np.einsum("ei,eip->ep", r.reshape(-1, 2), slopes)  # (e, p)
        flat = pull / (self._distance_sq(r) + SOFTENING_M**2)
        return self.grad_hess(r, proj)[1] - along.T @ (flat[:, None] * along)

    def _distance_sq(self, r: np.ndarray) -> np.ndarray:
        return (r.reshape(-1, 2) ** 2).sum(axis=1)
