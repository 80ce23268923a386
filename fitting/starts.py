"""Where descents begin: the best points of a screening that lie apart and swim forward from rest."""

import numpy as np

from fitting.search_space import SearchSpace


def promising(space: SearchSpace, points: np.ndarray, wanted: int, apart: float) -> list[np.ndarray]:
    """(p,) at most as many points as wanted; backward swimmers only where too few swim forward.

    Args:
        space: of the points.
        points: (p, s) best first.
        wanted: how many.
        apart: distance that any two keep at least, in roots of the coefficients.
    """
    chosen: list[np.ndarray] = []
    backward: list[np.ndarray] = []

    def choose(point: np.ndarray) -> None:
        if len(chosen) < wanted and all(np.linalg.norm(point[:5] - other[:5]) > apart for other in chosen):
            chosen.append(point)

    for some in np.array_split(points, range(wanted, points.shape[1], wanted), axis=1):
        if len(chosen) == wanted:
            break
        for point, forward in zip(some.T, space.swims_forward(some), strict=True):
            if forward:
                choose(point)
            else:
                backward.append(point)
    for point in backward:
        choose(point)
    return chosen
