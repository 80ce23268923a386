"""A walk along the floor of a valley: the coefficient that the data hold least moves over its range, the rest follow.

A weakly held coefficient bends the valley and can leave it two floors, more apart than a descent or a hop reaches.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fitting.search_space import ROOTS, SearchSpace

ELSEWHERE = 0.6  # in roots: what lies nearer is where one came from
_FRACTIONS = np.array([1.0, 0.5, 0.2])  # of a step that are tried


class Step(NamedTuple):
    """One place on the floor of a valley.

    Attributes:
        point: (p,) of the search space.
        objective_m: softened mean distance, m.
        distance_m: mean distance, m.
    """

    point: np.ndarray
    objective_m: float
    distance_m: float


def along_valley(space: SearchSpace, floor: np.ndarray, index: int, steps: int) -> list[np.ndarray]:
    """(p,) the two lowest points elsewhere along a valley, lower one first.

    Args:
        space: to walk in.
        floor: (p,) where the walk begins, in both directions.
        index: of the coefficient that is moved, over its whole range in roots.
        steps: that the range is divided by.
    """
    roots = np.linspace(ROOTS[0], ROOTS[1], steps + 1)
    below, above = roots[roots < floor[index]][::-1], roots[roots > floor[index]]
    passed = sorted(
        walk(space, floor, index, below) + walk(space, floor, index, above), key=lambda step: step.objective_m
    )
    chosen = [floor]
    for point in (step.point for step in passed):
        if all(abs(point[index] - other[index]) > ELSEWHERE for other in chosen):
            chosen.append(point)
    return chosen[1:3]


def walk(
    space: SearchSpace, floor: np.ndarray, index: int, roots: np.ndarray, known: Sequence[np.ndarray] = ()
) -> list[Step]:
    """The floor at each root in turn of one coefficient, each from the one before.

    Args:
        space: to walk in.
        floor: (p,) where the walk begins.
        index: of the coefficient that is held at the roots.
        roots: (k,) of it, from near to far.
        known: (p,) points, the nearest of which a place is looked for from as well, and the lower one taken.
    """
    steps, point = [], floor
    for root in roots:
        nearest = sorted(known, key=lambda other: abs(other[index] - root))[:1]
        starts = np.column_stack([moved(start, index, root) for start in (point, *nearest)])
        step = settle(space, np.unique(starts, axis=1), index)
        steps.append(step)
        point = step.point
    return steps


def moved(point: np.ndarray, index: int, root: float) -> np.ndarray:
    """(p,) a point (p,) with one of its parameters at a root."""
    return np.where(np.arange(len(point)) == index, root, point)


def settle(space: SearchSpace, points: np.ndarray, held: int) -> Step:
    """The lowest of points (p, s) after the best part of one Gauss-Newton step in all but the held coefficient."""
    errors, free = space.errors(points), np.delete(np.arange(space.size), held)
    lowest = int(np.argmin(_values(space, errors)))
    point, errors = points[:, lowest], errors[:, lowest, None]
    gradient, curvature = space.norm.grad_hess(errors, space.slopes_ahead(point[:, None], errors))
    step = np.zeros(space.size)
    step[free] = -np.linalg.lstsq(curvature[np.ix_(free, free)], gradient[free, 0], rcond=1e-8)[0]
    tried = np.clip(point[:, None] + step[:, None] * _FRACTIONS, space.low[:, None], space.high[:, None])
    places, errors = np.column_stack([point, tried]), np.column_stack([errors, space.errors(tried)])
    values = _values(space, errors)
    best = int(np.argmin(values))
    return Step(places[:, best], values[best], float(space.norm.plain(errors[:, best, None])))


def _values(space: SearchSpace, errors: np.ndarray) -> list[float]:
    """(s,) softened mean distance for errors (2 e, s), m."""
    return [float(space.norm.value(column[:, None])) for column in errors.T]
