"""The five fluid coefficients, jointly over all fit trials: robust Gauss-Newton from many starts.

The objective has several valleys and a rough floor (see `fitting.search_space`), so one descent is not enough:
screen the box, give the best points that lie apart a short heat, the better half of them another, polish the winners,
walk and hop along the valley of the best (see `fitting.valley`), and go on from there if it was still improving.
A twin that would swim backward from rest ranks behind all that swim forward (see `fitting.from_rest`). Where good
restarts end apart, the result says so.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import count, zip_longest

import numpy as np
from mujoco.minimize import IterLog, least_squares

from fitting.coefficient_fit import CoefficientFit, Restart, flags_of
from fitting.objective import Swims
from fitting.precision import covariance, intervals
from fitting.search_space import SearchSpace, parameters
from fitting.valley import along_valley
from swimmer import FluidCoefficients

Progress = Callable[[float, float], None]
_TOLERANCE = 1e-3  # relative size of a step that ends a descent
_DAMPING_FACTOR = 3.0  # between tries of a step
_APART = 1.6  # starts, in roots
_HOP_ITERATIONS = 5
_FLOOR_WIDTH = 16  # hops along the floor of a valley
_CHECKED = 8  # of the hops, whether they swim forward


@dataclass(frozen=True)
class Effort:
    """How hard to search.

    Attributes:
        screened: points of the box looked at.
        starts: of these the best that lie apart, which all take part in the first heat, the better half of them in
            the second.
        finalists: of these again the best, which are polished.
        heat_iterations, final_iterations: of Gauss-Newton at most.
        valley_steps: of the walk along the best one's valley, whose lowest two points elsewhere are polished, and then
            the best of some hops along its floor; 0: neither.
        last_iterations: of Gauss-Newton at most, with central differences, from a best that has not converged yet.
        budget_s: simulated seconds for the other searches (see `fitting.methods`).
        finish_s: simulated seconds for the simplices at the end (see `fitting.valley_simplex`).
    """

    screened: int
    starts: int
    finalists: int
    heat_iterations: int
    final_iterations: int
    valley_steps: int
    last_iterations: int
    budget_s: float
    finish_s: float

    @property
    def descents(self) -> int:
        """How many descents there will be at most."""
        valley, last = 3 * (self.valley_steps > 0), int(self.last_iterations > 0)
        return self.starts + self.second_heat + self.finalists + valley + last

    @property
    def second_heat(self) -> int:
        """How many starts take part in the second heat; none where that would only be the finalists."""
        half = self.starts // 2
        return half if half > self.finalists else 0


FULL = Effort(
    screened=64,
    starts=12,
    finalists=3,
    heat_iterations=3,
    final_iterations=6,
    valley_steps=6,
    last_iterations=8,
    budget_s=18_000.0,
    finish_s=4_000.0,
)
QUICK = Effort(
    screened=32,
    starts=3,
    finalists=1,
    heat_iterations=3,
    final_iterations=6,
    valley_steps=0,
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
    began, random = time.perf_counter(), np.random.default_rng(seed)
    search = _Search(swims, effort, progress or _untold)
    space = search.space
    heats = search.descend(_starts(space, effort, random) if starts is None else starts, effort.heat_iterations)
    if effort.second_heat:
        heats = search.go_on(heats[: effort.second_heat], effort.heat_iterations)
    search.go_on(heats[: effort.finalists], effort.final_iterations)
    if effort.valley_steps:
        search.descend(_elsewhere(space, search.best, effort.valley_steps), _HOP_ITERATIONS)
        search.descend(_hops_on_floor(space, search.best, random)[:1], _HOP_ITERATIONS)
    if effort.last_iterations and not search.best.converged:
        search.go_on([search.best], effort.last_iterations, central=True)
    search.told(1.0, search.best.objective_m)
    return _result(swims, space, search.restarts, began, tuple(search.trace), intervals(space, search.best.point))


class _Search:
    """Descents, some of which go on from others, and what has come of them so far, best first."""

    def __init__(self, swims: Swims, effort: Effort, told: Progress) -> None:
        self.space, self.told = SearchSpace(swims), told
        self.restarts: list[Restart] = []
        self.trace: list[tuple[float, float]] = []
        self._swims, self._effort, self._done = swims, effort, count(1)

    @property
    def best(self) -> Restart:
        return self.restarts[0]

    def descend(self, points: list[np.ndarray], iterations: int) -> list[Restart]:
        """From points (p,); what came of each, best first."""
        return self._ranked([self._tell(_descend(self.space, point, iterations)) for point in points])

    def go_on(self, starts: list[Restart], iterations: int, central: bool = False) -> list[Restart]:
        """From where others ended, whose place they take unless they turned round."""
        ended = [self._tell(_descend(self.space, r.point, iterations, r, central)) for r in starts]
        return self._ranked(ended, starts)

    def _tell(self, restart: Restart) -> Restart:
        share = min(next(self._done) / self._effort.descents, 1.0)
        self.told(share, (*self.restarts[:1], restart)[0].objective_m)
        return restart

    def _ranked(self, ended: list[Restart], before: Sequence[Restart] = ()) -> list[Restart]:
        ended = _checked(self.space, ended)
        for restart, earlier in zip_longest(ended, before):
            if earlier is not None and restart.swims_forward >= earlier.swims_forward:
                self.restarts.remove(earlier)
        self.restarts = sorted((*self.restarts, *ended), key=_rank)
        if any(self.best is restart for restart in ended) and self.best.swims_forward:
            self.trace.append((self.space.spent_s, _mean_distance(self._swims, self.best)))
        return sorted(ended, key=_rank)


def _untold(_share: float, _best_m: float) -> None:
    """Progress that nobody asked for."""


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
    ended = [_descend(space, point, iterations, central=central) for point in points]
    return _result(swims, space, sorted(_checked(space, ended), key=_rank), began)


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
    screened = space.screened(effort.screened, random)
    best = np.argsort(screened.objective_m)[: effort.screened // 2]
    return space.promising(screened.points[:, best], effort.starts, _APART)


def _elsewhere(space: SearchSpace, best: Restart, steps: int) -> list[np.ndarray]:
    """(p,) the lowest points along the valley of the best, which the least determined coefficient runs through."""
    weakest = int(np.argmax(np.diag(covariance(space, best.point))[:5]))
    return along_valley(space, best.point, weakest, steps)


def _hops_on_floor(space: SearchSpace, best: Restart, random: np.random.Generator) -> list[np.ndarray]:
    """(p,) the two best of some points along the floor of the valley, drawn as the noise may have moved the best."""
    values, vectors = np.linalg.eigh(covariance(space, best.point))
    steps = np.sqrt(np.abs(values))[:, None] * random.normal(size=(space.size, _FLOOR_WIDTH))
    points = np.clip(best.point[:, None] + vectors @ steps, space.low[:, None], space.high[:, None])
    return list(_forward_first(space, points[:, np.argsort(space.objectives(points))[:_CHECKED]])[:, :2].T)


def _forward_first(space: SearchSpace, points: np.ndarray) -> np.ndarray:
    """(p, s) the same points, those whose twin swims forward from rest first, else in the order given."""
    return points[:, np.argsort(~space.swims_forward(points), kind="stable")]


def _descend(
    space: SearchSpace, start: np.ndarray, iterations: int, before: Restart | None = None, central: bool = False
) -> Restart:
    """Gauss-Newton from a point, unchecked; what a heat did before is put in front of its history."""
    trace: list[IterLog]
    x, trace = least_squares(
        start.copy(),
        space.errors,
        bounds=(space.low, space.high),
        jacobian=space.slopes if central else space.slopes_ahead,
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
    )


def _checked(space: SearchSpace, ended: list[Restart]) -> list[Restart]:
    """The same, with the note which of them swim forward from rest: all in one batch."""
    if not ended:
        return []
    forward = space.swims_forward(np.stack([restart.point for restart in ended], axis=1))
    return [replace(restart, swims_forward=bool(swims)) for restart, swims in zip(ended, forward, strict=True)]


def _rank(restart: Restart) -> tuple[bool, float]:
    """Best first: those that swim forward from rest, each group by its objective."""
    return not restart.swims_forward, restart.objective_m


def _mean_distance(swims: Swims, restart: Restart) -> float:
    return float(swims.mean_distance(parameters(restart.point)[:, None])[0])
