"""Search for the mode of the posterior density.

Many descents (`fitting.descent`) begin at the likeliest of points all over the box, and race against each other. The
winner is refined with fine time steps. At its end it hops about in what the trials allow, for the twin is rough, and
follows the boundary of twins that swim forward from rest, or passes through it.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from scipy.linalg import solve_triangular
from scipy.stats import qmc

from fitting.covariance import MEDIANS, Block, Covariance
from fitting.descent import COARSE, DRAWN, ROUNDS, Descent, Tried, Whitened
from fitting.features import SPEED
from fitting.mode import Mode, blocks_at
from fitting.progress import Progress
from fitting.session_model import SessionModel
from swimcal.errors import SimulationDiverged
from swimcal.mjcf import COEFFICIENT_BOUNDS, PUBLISHED_COEFFICIENTS

# The race
_SCREENED = 128  # points that are simulated to begin with
_SCREENING = 0.3  # share of the time of a search until its descents begin
_TRIED = 4  # candidates for each start whose twins are simulated from rest
_BEGUN = 2  # descents at first, for each start
_STARTS_APART = 0.25  # least distance of two starts in the root of one coefficient, as a share of the box
_RACES = ((2, 1.0), (6, 0.5))
"""Rounds after which descents are dropped, and how many for each start then go on."""

# The end
_HOPS = 2  # hops from the end of the best descent
_HOPPED = 32  # points of each hop
_WIDE = (1.5, 3.0)  # scatter of either half of points drawn about an end, in standard deviations
_SD_OF_MEDIAN = 1.4826  # standard deviation of a normal distribution over its median absolute deviation
_ALONG = 8  # rounds along the boundary of twins that swim forward from rest
_CLEARLY = 0.5  # least gain in log density that is not the twin's roughness


def find_mode(
    model: SessionModel, starts: int = 3, seed: int = 0, tell: Progress = lambda _message, _share: None
) -> Mode:
    """Find the likeliest coefficients of a session's fitted trials.

    Args:
        model: the trials; their features hold the course.
        starts: twice as many descents begin at the likeliest of the screened points, those first whose twins swim
            forward from rest, which stay so; as many as this go on after 2 rounds, half of them after 6.
        seed: seed of the screening.
        tell: takes messages with the share of the work that is done.

    Raises:
        SimulationDiverged: the twin diverged from every start.
    """
    tell("looking for starts of the search", 0.0)
    # Points all over the box, even in the roots; the published coefficients come first.
    box = COEFFICIENT_BOUNDS[1] * qmc.Sobol(5, seed=seed).random_base2(int(np.ceil(np.log2(_SCREENED)))) ** 2
    points = np.vstack([PUBLISHED_COEFFICIENTS, box[: _SCREENED - 1]])
    promising, blocks = _choose_promising(model, points, model.simulated(points), _BEGUN * starts)
    descents = [Descent(model, start, blocks) for start in promising]
    racing, before, done, expected = descents, 0, 0, _expected_steps(len(descents), starts)
    for rounds, left in (*_RACES, (ROUNDS, 0.0)):
        for descent in racing:
            tell("fitting the coefficients", _SCREENING + (1 - _SCREENING) * min(done / expected, 0.99))
            descent.run(rounds)
            done += rounds - before
        before = rounds
        racing = sorted(racing, key=lambda each: (not each.forward, -each.promise))[: max(int(left * starts), 1)]
    for descent in descents:
        descent.look_back()
    while not (found := sorted(descents, key=lambda each: (not each.forward, -each.log_density)))[0].done:
        found[0].run(ROUNDS)
    found[0].refine()
    found[0] = pass_through(follow_boundary(hop(found[0], seed)), seed)
    found[0].settle(_CLEARLY)
    spent = len(points) + sum(each.simulated for each in found)
    found = [each for each in found if each.alive]
    if not found:
        raise SimulationDiverged("the twin diverged from every start; look into the flags of the fit trials")
    ends = tuple(each.mode.ends[0] for each in found)
    return replace(found[0].mode, ends=ends, simulations=spent)


def find_mode_near(model: SessionModel, before: Mode, seed: int = 0) -> Mode:
    """Find the mode of a model whose time step is finer, from that of the same trials with coarser steps.

    Args:
        model: the trials, with the finer step.
        before: the mode with coarser steps; its other ends stay as far below the best as they were.
        seed: seed of the points about the end.

    Raises:
        SimulationDiverged: the twin diverges there.
    """
    model = model.rolling(before.roll)
    descent = Descent(model, before.coefficients, blocks_at(model, before.coefficients, COARSE))
    descent.run(ROUNDS)
    descent.refine(COARSE)
    descent = hop(descent, seed)
    if not descent.alive:
        raise SimulationDiverged("the twin diverged with the finer time step that its speed asks for")
    found, was = descent.mode, before.ends[0].log_density
    others = (end._replace(log_density=end.log_density - was + descent.log_density) for end in before.ends[1:])
    return replace(found, ends=(*found.ends, *others), simulations=before.simulations + descent.simulated)


def _expected_steps(descents: int, starts: int) -> float:
    """Return the expected rounds of all descents.

    Those that go on to the end count half the rounds, as they converge on the way.
    """
    steps, before, racing = 0.0, 0, descents
    for rounds, left in _RACES:
        steps, before, racing = steps + racing * (rounds - before), rounds, max(int(left * starts), 1)
    return steps + racing * (ROUNDS - before) / 2


def hop(descent: Descent, seed: int) -> Descent:
    """Go on from the best of points drawn about the end, if that is likelier; return the likelier descent.

    The twin is rough by some hundredths of a millimetre, so that gradients end in hollows of that depth.

    Args:
        descent: a descent at its end.
        seed: seed of the points.
    """
    best, random = descent, np.random.default_rng([seed, 37])
    for _ in range(_HOPS if descent.alive else 0):
        white = best.whitened()
        tried = best.swim_at(_draw_about(best.at, white, _HOPPED, random))
        best.spread = _spread_of_ends(tried, white)
        there = best.best_of(tried, white)
        descent.simulated = best.simulated
        if there is None:
            break
        other = best.moved(there)
        other.run_on(_RACES[-1][0])
        descent.simulated = other.simulated
        if other.log_density <= best.log_density:
            break
        best = other
    return best


def follow_boundary(descent: Descent) -> Descent:
    """Go on along the boundary of twins that swim forward from rest, and return the likelier descent.

    The new one must be clearly likelier. Steps that cross the boundary are refused.

    Args:
        descent: a descent at its end.
    """
    if not (descent.forward and descent.alive):
        return descent
    white = descent.whitened()
    if white.residual @ white.residual - white.squares_after(white.step_from(descent.at)) < 2 * _CLEARLY:
        return descent
    other = copy(descent)
    other.follows_boundary = True
    other.run_on(_ALONG)
    descent.simulated = other.simulated
    return other if other.log_density > descent.log_density + _CLEARLY else descent


def pass_through(descent: Descent, seed: int) -> Descent:
    """Go on through twins that swim backward from rest, to likelier ones that do not; return the likelier descent.

    The new one must be clearly likelier. A descent that must swim forward all the way stops in front of such twins.
    Where a free one ends at one of them, it goes on from the likeliest of points about there that swim forward.

    Args:
        descent: a descent at its end.
        seed: seed of these points.
    """
    if not (descent.forward and descent.blocked and descent.alive):
        return descent
    free = copy(descent)
    free.forward, free.follows_boundary = False, False
    free.run_on(_ALONG)
    if free.log_density > descent.log_density + _CLEARLY:
        free.look_back()
        if not free.forward:
            free = _come_back(free, seed)
    descent.simulated = free.simulated
    return free if free.forward and free.log_density > descent.log_density + _CLEARLY else descent


def _come_back(free: Descent, seed: int) -> Descent:
    """Go to the likeliest of points drawn about a descent whose twins swim forward, and on from there."""
    white = free.whitened()
    drawn = _draw_about(free.at, white, DRAWN, np.random.default_rng([seed, 41]))
    drawn = drawn[free.model.swim_forward(drawn)]
    if not len(drawn):
        return free
    tried = free.swim_at(drawn)
    back = free.moved(tried.place(int(white.squares_of(tried.residuals).argmin())))
    back.forward = True
    back.run_on(_ALONG)
    return back


def _draw_about(at: np.ndarray, white: Whitened, count: int, random: np.random.Generator) -> np.ndarray:
    """Draw points (s, 5) about an end (5,), one half within its uncertainty, the other farther off."""
    wide = np.repeat(_WIDE, count // len(_WIDE))[:, None]
    return np.clip(at + wide * random.standard_normal((count, 5)) @ white.scatter, *COEFFICIENT_BOUNDS)


def _spread_of_ends(tried: Tried, white: Whitened) -> np.ndarray:
    """Return how far single steps from points about the end lead apart, as standard deviations (5,).

    Were the twin linear, each would lead to the end itself. The median serves, as some twins near it may settle in
    another steady state.

    Args:
        tried: the points.
        white: residual and Jacobian at the end.
    """
    left = solve_triangular(white.root, tried.residuals.T, lower=True)
    scatter = white.scatter
    ends = tried.points + (scatter.T @ scatter @ (white.jacobian.T @ left)).T
    return np.asarray(_SD_OF_MEDIAN * np.median(np.abs(ends - np.median(ends, axis=0)), axis=0))


def _choose_promising(
    model: SessionModel, points: np.ndarray, simulated: np.ndarray, count: int
) -> tuple[Sequence[np.ndarray], tuple[Block, ...]]:
    """Return the likeliest of the points (s, 5) by what they simulate (s, K), and the blocks they are ranked with.

    The first look is relative to how fast and wide each beat is. Nuisances are simulated at the best point so found; in
    their covariance all points are ranked by their residuals, those first that swim forward from rest.

    Raises:
        SimulationDiverged: the twin diverged at all points.
    """
    measured = model.measured.reshape(len(model.trials), -1)
    rows = simulated.reshape(len(points), *measured.shape)
    speed = (rows[..., SPEED] - measured[..., SPEED]) / np.maximum(np.abs(measured[..., SPEED]), 1e-3)
    wave = np.linalg.norm(rows[..., 1:] - measured[..., 1:], axis=-1) / np.linalg.norm(measured[..., 1:], axis=-1)
    misfit = (speed**2 + wave**2).sum(axis=-1)
    for first in (i for i in np.argsort(misfit) if np.isfinite(misfit[i])):
        blocks = blocks_at(model, points[first], COARSE)
        if all(block.is_finite for block in blocks):
            break
    else:
        raise SimulationDiverged("the twin diverged from every start; look into the flags of the fit trials")
    root = np.linalg.cholesky(Covariance.of(blocks).at(MEDIANS))
    residual = np.nan_to_num(model.measured - simulated, nan=1e3)
    squares = (solve_triangular(root, residual.T, lower=True) ** 2).sum(axis=0)
    order = np.array([i for i in np.argsort(squares)[: _TRIED * count] if np.isfinite(simulated[i]).all()])
    forward = model.swim_forward(points[order])
    ranked = [*order[forward], *order[~forward]]
    chosen: list[int] = []
    roots = np.sqrt(points / COEFFICIENT_BOUNDS[1])
    for i in ranked:
        if all(np.abs(roots[i] - roots[other]).max() > _STARTS_APART for other in chosen):
            chosen.append(i)
    chosen += [i for i in ranked if i not in chosen]
    return [points[i] for i in chosen[:count]], blocks
