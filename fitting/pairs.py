"""One lucky pair of fit trials proves nothing: the identification repeated on other pairs of the session's swims."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from fitting.coefficient_fit import CoefficientFit
from fitting.coefficients import refine_coefficients
from fitting.ebt import FORMS, fit_ebt
from fitting.forecast import fit_phase, forecast
from fitting.objective import Swims
from fitting.phase import phase_from_harmonic
from fitting.speed import forward_speed
from fitting.tail_tip import measured_tail
from fitting.trial import MeasuredTrial
from session import NotEnoughData
from swimmer import FluidCoefficients, Twin

MOST_PAIRS = 10


@dataclass(frozen=True)
class PairFit:
    """One choice of two fit trials, all other swims held out.

    Attributes:
        fitted: names of the two.
        coefficients: found on them.
        marker_error_m: mean over the two, as the search minimises it, m.
        speed_mae: mean absolute speed error over the others, m/s: "twin", and each form of elongated body theory.
        swims_forward: the twin swims forward from rest.
    """

    fitted: tuple[str, str]
    coefficients: FluidCoefficients
    marker_error_m: float
    speed_mae: dict[str, float]
    swims_forward: bool


def fit_pairs(
    trials: Sequence[MeasuredTrial],
    twin: Twin,
    fit: CoefficientFit,
    seed: int = 0,
    tell: Callable[[str, float | None], None] = lambda _message, _share: None,
) -> tuple[PairFit, ...]:
    """Fits on every pair of swims (a random choice of them when there are many) and forecasts the others.

    Each search is a single descent from the session's own fit, so the spread is that within its valley.

    Args:
        trials: all swims.
        twin: with their markers.
        fit: of the session.
        seed: of the choice.
        tell: called with what is going on and the share of the evidence that is done.
    """
    pairs = list(combinations(range(len(trials)), 2))
    if len(pairs) > MOST_PAIRS:
        chosen = np.random.default_rng(seed).choice(len(pairs), MOST_PAIRS, replace=False)
        pairs = [pairs[i] for i in sorted(chosen)]
    if len(trials) < 3:
        return ()
    fits = []
    for i, pair in enumerate(pairs):
        tell("fitting other pairs of trials", 0.15 + 0.85 * i / len(pairs))
        fits.append(_fit_pair(trials, pair, twin, fit.coefficients))
    return tuple(fits)


def _fit_pair(trials: Sequence[MeasuredTrial], pair: tuple[int, ...], twin: Twin, start: FluidCoefficients) -> PairFit:
    fitted = tuple(trials[i].with_role("fit") for i in pair)
    values = np.array([start], float)
    phases = [phase_from_harmonic(twin, trial, values, trial.frequency.hz)[0] for trial in fitted]
    fit = refine_coefficients(Swims(twin, fitted), [np.append(np.sqrt(start), phases)], iterations=6, central=False)
    held_out = list(_held_out(trial for i, trial in enumerate(trials) if i not in pair))
    return PairFit(
        fitted=(fitted[0].name, fitted[1].name),
        coefficients=fit.coefficients,
        marker_error_m=fit.mean_distance_m,
        speed_mae=_speed_errors(fitted, held_out, twin, fit.coefficients),
        swims_forward=fit.restarts[0].swims_forward,
    )


def _held_out(trials: Iterable[MeasuredTrial]) -> Iterator[MeasuredTrial]:
    """The trials as held out; those too short for that are left out."""
    for trial in trials:
        with suppress(NotEnoughData):
            yield trial.with_role("holdout")


def _speed_errors(
    fitted: Sequence[MeasuredTrial], held_out: Sequence[MeasuredTrial], twin: Twin, coefficients: FluidCoefficients
) -> dict[str, float]:
    errors: dict[str, list[float]] = {"twin": []}
    tails = [measured_tail(trial, twin.robot, trial.kept) for trial in fitted]
    ebts = [fit_ebt(form, tails, np.array([trial.speed for trial in fitted]), twin.robot) for form in FORMS]
    for trial in held_out:
        hz = trial.start_frequency.hz
        head = forecast(twin, trial, coefficients, fit_phase(twin, trial, coefficients), hz)
        speed = float(forward_speed(trial.time_s, head.forward_m, trial.kept, trial.frequency.hz))
        errors["twin"].append(abs(speed - trial.speed))
        tail = measured_tail(trial, twin.robot, trial.kept)
        for ebt in ebts:
            errors.setdefault(ebt.form.name, []).append(abs(ebt.speed(tail, twin.robot) - trial.speed))
    return {name: float(np.mean(values)) if values else float("nan") for name, values in errors.items()}
