"""The five fluid coefficients, jointly over all fit trials: robust Gauss-Newton from many starts.

The objective has several valleys and a rough floor (see `fitting.search_space`), so one descent is not enough:
screen the box, give the best few points that lie apart a short heat, polish the winners, hop around the best, walk and
hop along its valley (see `fitting.valley`), and go on from the best if it was still improving.
A twin that would swim backward from rest ranks behind all that swim forward (see `fitting.from_rest`). Where good
restarts end apart, the result says so.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from mujoco.minimize import IterLog, least_squares
from scipy.stats import qmc

from fitting.coefficient_fit import CoefficientFit, Restart, flags_of
from fitting.objective import Swims
from fitting.precision import covariance, intervals
from fitting.search_space import ROOTS, SearchSpace, parameters
from fitting.valley import along_valley
from swimmer import PUBLISHED_COEFFICIENTS, FluidCoefficients

Progress = Callable[[float, float], None]
_TOLERANCE = 1e-3  # relative size of a step that ends a descent
_DAMPING_FACTOR = 3.0  # between tries of a step
_HOP = (0.35, 0.08)  # spread of hops in roots and in phases (rad)
_HOP_ITERATIONS = 5
_FLOOR_WIDTH = 16  # hops along the floor of a valley
_CHECKED = 8  # of the hops, whether they swim forward


@dataclass(frozen=True)
class Effort:
    """How hard to search.

    Attributes:
        screened: points of the box looked at.
        starts: of these the best that lie `apart` (in roots), which all take part in the heats.
        finalists: of these again the best, which are polished.
        heat_iterations, final_iterations: of Gauss-Newton at most.
        hops: rounds of hops around the best point so far.
        hop_width: points tried in each round, of which the best two are polished.
        valley_steps: of the walk along the best one's valley, whose lowest two points elsewhere are polished, and then
            the best of some hops along its floor; 0: neither.
        last_iterations: of Gauss-Newton at most, from a best that has not converged yet.
        budget_s: simulated seconds for the other searches (see `fitting.methods`).
        finish_s: simulated seconds for the simplex at the end.
    """

    screened: int
    starts: int
    finalists: int
    heat_iterations: int
    final_iterations: int
    valley_steps: int
    hops: int
    hop_width: int
    last_iterations: int
    budget_s: float
    finish_s: float
    apart: float = 1.6

    @property
    def descents(self) -> int:
        """How many descents there will be at most."""
        return self.starts + self.finalists + 2 * self.hops + 3 * (self.valley_steps > 0)


FULL = Effort(
    screened=64,
    starts=6,
    finalists=3,
    heat_iterations=3,
    final_iterations=8,
    valley_steps=6,
    hops=1,
    hop_width=40,
    last_iterations=8,
    budget_s=14_000.0,
    finish_s=2_000.0,
)
QUICK = Effort(
    screened=32,
    starts=3,
    finalists=1,
    heat_iterations=3,
    final_iterations=6,
    valley_steps=0,
    hops=0,
    hop_width=0,
    last_iterations=0,
    budget_s=3_000.0,
    finish_s=0.0,
)


def fit_coefficients(
    swims: Swims,
    effort: Effort = FULL,
    seed: int = 0,
    progress: Progress | None = None,
    starts: list[np.ndarray] | None = None,
) -> CoefficientFit:
    """Fits the five coefficients and a crank phase a trial.

    Args:
        swims: the fit trials and the twin.
        effort: how hard to search.
        seed: of screening and hops.
        progress: called with the share done, 0 to 1, and the best mean distance so far, m.
        starts: points (p,) of the search space to begin with; default: the best of a screening of the box.
    """
    began = time.perf_counter()
    space, random = SearchSpace(swims), np.random.default_rng(seed)
    restarts: list[Restart] = []
    trace: list[tuple[float, float]] = []

    def add(points: list[np.ndarray], iterations: int, before: list[Restart] | None = None) -> list[Restart]:
        for i, point in enumerate(points):
            restart = _descend(space, point, iterations, before[i] if before else None)
            restarts.append(restart)
            restarts.sort(key=_rank)
            if restarts[0] is restart and restart.swims_forward:
                trace.append((space.spent_s, _mean_distance(swims, restart)))
            if progress is not None:
                progress(min(len(restarts) / effort.descents, 1.0), restarts[0].objective_m)
        return restarts

    starts = _starts(space, effort, random) if starts is None else starts
    heats = add(starts, effort.heat_iterations)[: effort.finalists]
    add([heat.point for heat in heats], effort.final_iterations, heats)
    for _ in range(effort.hops):
        add(_hops(space, restarts[0], effort.hop_width, random), _HOP_ITERATIONS)
    if effort.valley_steps:
        add(_elsewhere(space, restarts[0], effort.valley_steps), _HOP_ITERATIONS)
        add(_hops_on_floor(space, restarts[0], random)[:1], _HOP_ITERATIONS)
    if effort.last_iterations and not restarts[0].converged:
        add([restarts[0].point], effort.last_iterations, restarts[:1])
    return _result(swims, space, restarts, began, tuple(trace), intervals(space, restarts[0].point))


def refine_coefficients(
    swims: Swims, points: list[np.ndarray], iterations: int = 6, central: bool = True
) -> CoefficientFit:
    """The nearest valley from known points (p,) of the search space (see `Restart.point`), without a search.

    Args:
        swims: the fit trials and the twin.
        points: where to start.
        iterations: of Gauss-Newton at most, from each.
        central: central differences, or one-sided ones at half the price.
    """
    began, space = time.perf_counter(), SearchSpace(swims)
    restarts = sorted((_descend(space, point, iterations, central=central) for point in points), key=_rank)
    return _result(swims, space, restarts, began)


def _result(
    swims: Swims,
    space: SearchSpace,
    restarts: list[Restart],
    began: float,
    trace: tuple[tuple[float, float], ...] = (),
    interval: np.ndarray | None = None,
) -> CoefficientFit:
    """A fit from restarts, best first."""
    best = restarts[0]
    return CoefficientFit(
        coefficients=FluidCoefficients(*map(float, best.coefficients)),
        phase_rad=best.phase_rad,
        mean_distance_m=_mean_distance(swims, best),
        restarts=tuple(restarts),
        evaluations=space.evaluations,
        seconds=time.perf_counter() - began,
        flags=flags_of(restarts, interval),
        spent_s=space.spent_s,
        trace=trace,
        interval=interval,
    )


def _starts(space: SearchSpace, effort: Effort, random: np.random.Generator) -> list[np.ndarray]:
    """(p,) the most promising points of the box that lie apart, forward swimmers first, in step with the trials."""
    roots = ROOTS[0] + np.ptp(ROOTS) * qmc.Sobol(5, rng=random).random(effort.screened)
    points = space.in_step(np.vstack([PUBLISHED_COEFFICIENTS, roots**2]))
    points = _forward_first(space, points[:, np.argsort(space.objectives(points))[: effort.screened // 2]])
    chosen: list[np.ndarray] = []
    for point in points.T:
        if all(np.linalg.norm(point[:5] - other[:5]) > effort.apart for other in chosen):
            chosen.append(point)
        if len(chosen) == effort.starts:
            break
    return chosen


def _elsewhere(space: SearchSpace, best: Restart, steps: int) -> list[np.ndarray]:
    """(p,) the lowest points along the valley of the best, which the least determined coefficient runs through."""
    weakest = int(np.argmax(np.diag(covariance(space, best.point))[:5]))
    return along_valley(space, best.point, weakest, steps)


def _hops(space: SearchSpace, best: Restart, width: int, random: np.random.Generator) -> list[np.ndarray]:
    """(p,) the two best of some random points around the best so far, forward swimmers first."""
    spread = np.append(np.full(5, _HOP[0]), np.full(space.size - 5, _HOP[1]))
    return _best_around(space, best, spread[:, None] * random.normal(size=(space.size, width)))


def _hops_on_floor(space: SearchSpace, best: Restart, random: np.random.Generator) -> list[np.ndarray]:
    """The same along the floor of the valley: the points are drawn as the noise may have moved the best."""
    values, vectors = np.linalg.eigh(covariance(space, best.point))
    steps = np.sqrt(np.abs(values))[:, None] * random.normal(size=(space.size, _FLOOR_WIDTH))
    return _best_around(space, best, vectors @ steps)


def _best_around(space: SearchSpace, best: Restart, steps: np.ndarray) -> list[np.ndarray]:
    """(p,) the two best of the points that lie so many steps (p, s) from the best so far, forward swimmers first."""
    points = np.clip(best.point[:, None] + steps, space.low[:, None], space.high[:, None])
    return list(_forward_first(space, points[:, np.argsort(space.objectives(points))[:_CHECKED]])[:, :2].T)


def _forward_first(space: SearchSpace, points: np.ndarray) -> np.ndarray:
    """(p, s) the same points, those whose twin swims forward from rest first, else in the order given."""
    return points[:, np.argsort(~space.swims_forward(points), kind="stable")]


def _descend(
    space: SearchSpace, start: np.ndarray, iterations: int, before: Restart | None = None, central: bool = False
) -> Restart:
    """Gauss-Newton from a point; what a heat did before is put in front of its history."""
    trace: list[IterLog]
    x, trace = least_squares(
        start.copy(),
        space.errors,
        bounds=(space.low, space.high),
        jacobian=space.slopes if central or before is not None else space.slopes_ahead,
        norm=space.norm,
        xtol=_TOLERANCE,
        gtol=1e-10,
        max_iter=iterations,
        x_scale="jac",
        mu_factor=_DAMPING_FACTOR,
        verbose=0,
    )
    history = np.array([float(step.objective) for step in trace])
    return Restart(
        start=parameters(start)[:5] if before is None else before.start,
        coefficients=parameters(x)[:5],
        phase_rad=x[5:],
        objective_m=float(history[-1]),
        history_m=history if before is None else np.append(before.history_m[:-1], history),
        converged=len(trace) <= iterations,
        swims_forward=bool(space.swims_forward(x[:, None])[0]),
    )


def _rank(restart: Restart) -> tuple[bool, float]:
    """Best first: those that swim forward from rest, each group by its objective."""
    return not restart.swims_forward, restart.objective_m


def _mean_distance(swims: Swims, restart: Restart) -> float:
    return float(swims.mean_distance(parameters(restart.point)[:, None])[0])
