"""One lucky pair of fit trials proves nothing: the identification repeated on other pairs of the session's swims.

Every pair gets a small search of its own, which knows nothing of the session's fit nor of the trials that the pair
leaves out. What a point of the box is worth for a trial does not depend on which other trial it is paired with, so the
screening is shared: the same points for every choice, looked at once for each trial.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from fitting.coefficient_fit import Restart
from fitting.coefficients import refine_coefficients
from fitting.ebt import FORMS, FROM_TWIN, EbtFit, fit_every_form, speeds_beside
from fitting.forecast import forecast, phase_from_harmonic
from fitting.objective import Swims
from fitting.search_space import Screened, SearchSpace
from fitting.trial import MeasuredTrial
from session import NotEnoughData
from swimmer import FluidCoefficients, Twin

MOST_PAIRS = 10
SCREENED = 64  # points of the box
CHECKED, STARTS = 32, 2  # of these the best; of these again the best that lie apart and swim forward
APART = 1.0  # in roots
HEAT, POLISH = 3, 10  # iterations of Gauss-Newton at most
MODELS = ("twin", *(form.name + tail for tail in ("", FROM_TWIN) for form in FORMS))

Tell = Callable[[str, float], None]


@dataclass(frozen=True)
class PairFit:
    """One choice of two fit trials, all other swims held out.

    Attributes:
        fitted: names of the two, in order.
        coefficients: found on them.
        marker_error_m: mean over the two, as the search minimises it, m.
        speed_mae: mean absolute speed error over the others, m/s: "twin", each form of elongated body theory, and
            each form from the twin's tail ("<form>, twin's tail").
        swims_forward: the twin swims forward from rest; False only where no start of the search led to one that does.
        converged: the last step was small enough before the iterations ran out.
    """

    fitted: tuple[str, str]
    coefficients: FluidCoefficients
    marker_error_m: float
    speed_mae: dict[str, float]
    swims_forward: bool
    converged: bool


def fit_pairs(
    trials: Sequence[MeasuredTrial], twin: Twin, seed: int = 0, tell: Tell = lambda _message, _share: None
) -> tuple[PairFit, ...]:
    """Fits on every pair of swims (a random choice of them when there are many) and forecasts the others.

    In which order the trials come does not matter.

    Args:
        trials: all swims.
        twin: with their markers.
        seed: of the screening, and of the choice.
        tell: called with what is going on and the share of the pairs that is done.
    """
    if len(trials) < 3:
        return ()
    named = {trial.name: trial for trial in sorted(trials, key=lambda trial: trial.name)}
    pairs = chosen_pairs(tuple(named), seed)
    tell("fitting other pairs of trials", 0.0)
    screened = {name: screen(twin, trial.with_role("fit"), seed) for name, trial in named.items()}
    fits = []
    for i, pair in enumerate(pairs):
        tell("fitting other pairs of trials", (1 + i) / (1 + len(pairs)))
        fits.append(_fit_pair(named, pair, twin, screened))
    return tuple(fits)


def chosen_pairs(names: tuple[str, ...], seed: int) -> list[tuple[str, str]]:
    """All pairs of names, or some of them, drawn, where there are too many; by name, whatever order these come in."""
    pairs = list(combinations(sorted(names), 2))
    if len(pairs) <= MOST_PAIRS:
        return pairs
    return [pairs[i] for i in sorted(np.random.default_rng(seed).choice(len(pairs), MOST_PAIRS, replace=False))]


def _fit_pair(
    named: dict[str, MeasuredTrial], pair: tuple[str, str], twin: Twin, screened: dict[str, Screened]
) -> PairFit:
    fitted = tuple(named[name].with_role("fit") for name in pair)
    swims = Swims(twin, fitted)
    best = search_pair(swims, [screened[name] for name in pair])
    coefficients = FluidCoefficients(*map(float, best.coefficients))
    held_out = _held_out(trial for name, trial in named.items() if name not in pair)
    ebts = fit_every_form(fitted, twin.robot)
    return PairFit(
        fitted=pair,
        coefficients=coefficients,
        marker_error_m=float(swims.mean_distance(np.append(best.coefficients, best.phase_rad)[:, None])[0]),
        speed_mae=_mean_errors([_speed_errors(trial, twin, coefficients, ebts) for trial in held_out]),
        swims_forward=best.swims_forward,
        converged=best.converged,
    )


def screen(twin: Twin, trial: MeasuredTrial, seed: int) -> Screened:
    """Points of the box, the same for every trial, each in step with this one."""
    return SearchSpace(Swims(twin, (trial,))).screened(SCREENED, np.random.default_rng(seed))


def search_pair(swims: Swims, screened: Sequence[Screened]) -> Restart:
    """The best twin of some trials, from points screened for each; one that swims forward if any start led to one."""
    points = np.vstack([screened[0].points[:5], *(of_trial.points[5] for of_trial in screened)])
    best = np.argsort(np.mean([of_trial.objective_m for of_trial in screened], axis=0))[:CHECKED]
    starts = SearchSpace(swims).promising(points[:, best], STARTS, APART)
    heats = refine_coefficients(swims, starts, HEAT, central=False).restarts
    polished = refine_coefficients(swims, [heats[0].point], POLISH, central=False).restarts
    return min((*polished, *heats), key=lambda restart: (not restart.swims_forward, restart.objective_m))


def _held_out(trials: Iterable[MeasuredTrial]) -> Iterator[MeasuredTrial]:
    """The trials as held out; those too short for that are left out."""
    for trial in trials:
        with suppress(NotEnoughData):
            yield trial.with_role("holdout")


def _speed_errors(
    trial: MeasuredTrial, twin: Twin, coefficients: FluidCoefficients, ebts: dict[str, EbtFit]
) -> dict[str, float]:
    """How far each model is off the speed of a trial held out, m/s, by its name."""
    hz = trial.start_frequency.hz
    phase = float(phase_from_harmonic(twin, trial, np.array([coefficients], float), hz)[0])
    head = forecast(twin, trial, coefficients, phase)
    speeds = speeds_beside(trial, head, ebts, twin.robot)
    return {name: abs(speed - trial.speed) for name, speed in speeds.items()}


def _mean_errors(errors: Sequence[dict[str, float]]) -> dict[str, float]:
    """The mean over trials of each model's errors, m/s; nan where there is no trial."""
    return {model: float(np.mean([error[model] for error in errors])) if errors else np.nan for model in MODELS}
