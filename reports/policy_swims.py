"""How a policy swam: what the report shows of it."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class PolicySwims:
    """Episodes of one policy on the twin.

    Attributes:
        task: "target" or "circle".
        method: "search" or "sac".
        trained_s: how long it was trained.
        seed: of its training.
        of_this_fit: whether it was trained on the twin that the report is of.
        start_m: (n, 2) first targets, from the start, where the robot heads along -x; its left is -y.
        reached, diverged: (n,) how the episodes ended; neither: out of time.
        seconds: (n,) how long they lasted.
        off_path_m: (2, n) mean and largest distance from the path; nan without one.
        path_m: (k, m, 2) of the first m episodes, at even times; nan once one is over.
        radius_m: of the circle; nan without one.
    """

    task: str
    method: str
    trained_s: float
    seed: int
    of_this_fit: bool
    start_m: np.ndarray
    reached: np.ndarray
    diverged: np.ndarray
    seconds: np.ndarray
    off_path_m: np.ndarray
    path_m: np.ndarray
    radius_m: float = float("nan")

    @property
    def distance_m(self) -> np.ndarray:
        """(n,) of the targets from the start."""
        return np.asarray(np.hypot(*self.start_m.T))

    @property
    def aside_rad(self) -> np.ndarray:
        """(n,) of the targets from straight ahead, to either side."""
        return np.asarray(np.abs(np.arctan2(self.start_m[:, 1], -self.start_m[:, 0])))
