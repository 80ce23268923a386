"""The five fluid coefficients: where they ended, how far the data hold them, and how the search went."""

import numpy as np

from fitting import CoefficientFit
from fitting.coefficient_fit import equals_of, is_polished
from fitting.evidence import Evidence
from fitting.methods import METHODS
from fitting.objective import COEFFICIENT_BOUNDS
from reports.blocks import Plot, Plots, Prose, Section, Table, table_head
from reports.context import ReportContext
from reports.figures.coefficients import (
    coefficient_profiles_figure,
    coefficients_figure,
    convergence_figure,
    search_trace_figure,
)
from reports.numbers import MISSING, counted, in_mm, listed, sentence, shown, significant, spanned
from swimmer import PUBLISHED_COEFFICIENTS, FluidCoefficients

NEARLY = 1.1  # distance within this factor of the best: a value that the data hardly refuse

COLUMNS = table_head("coefficient | value [] | published [] | 95 % interval [] | range of equals [] | mind")


def build(context: ReportContext) -> Section:
    """Values with bounds, the objective along each, and the way the search went."""
    fit = context.calibration.fit
    method = METHODS[fit.method]
    text = (
        f"Found by {method}: {counted(len(fit.restarts), 'start')}, {fit.evaluations} simulations of the fit trials, "
        f"{shown(fit.seconds)} s. At the best, the mean marker distance over the fit trials is "
        f"{in_mm(fit.mean_distance_m)} mm. {_middle(fit)}{_agreement(fit)} {_determined(fit, context.evidence)}"
    )
    caveats = tuple(sentence(flag.message or flag.kind) for flag in fit.flags)
    blocks = (Plots(_values(fit, context.evidence)), Prose(text.strip()), _table(fit), Plots(_ways(fit)))
    return Section("Fluid coefficients", "coefficients", blocks, caveats)


def _values(fit: CoefficientFit, evidence: Evidence | None) -> tuple[Plot, ...]:
    values = Plot(
        coefficients_figure(fit),
        "coefficient-values",
        "Each coefficient within its bounds (grey). Dots where other starts ended: those far from the best "
        "and yet as good would mean that the data do not determine the coefficient. Crosses swim backward "
        "from rest, which the robot does not.",
    )
    if evidence is None:
        return (values,)
    figure = coefficient_profiles_figure(evidence.profiles, fit.coefficients)
    profiles = Plot(
        figure,
        "coefficient-profiles",
        "Mean marker distance along each coefficient, from bound to bound: dashed with all else held, solid where the "
        "others follow (to first order); dots where other starts that swim forward ended. The true profile may lie "
        "below the solid line, not above it: the line is an upper bound at its corners, which the dots below it are "
        "among. A narrow valley is a coefficient that the data hold; a flat one can slide at no cost; a valley that is "
        "narrow dashed and wide solid is traded against the others.",
    )
    return values, profiles


def _ways(fit: CoefficientFit) -> tuple[Plot, ...]:
    restarts = Plot(
        convergence_figure(fit),
        "convergence",
        "The objective, a softened mean marker distance, after each iteration of each start. A filled end "
        "converged; an open one ran out of iterations or budget or was given up for a better start. Where a search "
        "has no iterations, or Nelder-Mead finished it, its line has a step for each new best; these are chosen by "
        "the mean marker distance itself, so that the softened one may rise.",
    )
    if not fit.trace:
        return (restarts,)
    trace = Plot(
        search_trace_figure(fit),
        "trace",
        "Best mean marker distance so far over the simulated time that the whole search had spent. A long flat end "
        "says that more of the same search would hardly help.",
    )
    return restarts, trace


def _determined(fit: CoefficientFit, evidence: Evidence | None) -> str:
    """How far each coefficient can slide within a tenth of the distance, by its profile."""
    if evidence is None:
        return "Their profiles were not made for this session; `calib run` makes them."
    profiles = evidence.profiles
    ranges = []
    for i, name in enumerate(FluidCoefficients._fields):
        value, distance_m = profiles.curve(i, fit.coefficients[i])
        ends = _reach(value, distance_m / profiles.best_m)
        ranges.append(f"{name.replace('_', ' ')} {' to '.join(significant(end) for end in ends)}")
    return (
        f"By their profiles the distance comes within a tenth of the best over {listed(ranges)}; profiles are upper "
        "bounds, so the true ranges may be wider."
    )


def _reach(value: np.ndarray, ratio: np.ndarray) -> tuple[float, float]:
    """From the least to the greatest value at which a profile lies below NEARLY; straight between values (n,) on the
    square-root scale, some of which lie below.
    """
    root, below = np.sqrt(value), np.flatnonzero(ratio <= NEARLY)
    first, last = int(below[0]), int(below[-1])
    low = root[0] if first == 0 else np.interp(NEARLY, ratio[[first, first - 1]], root[[first, first - 1]])
    high = root[-1] if last == len(root) - 1 else np.interp(NEARLY, ratio[last : last + 2], root[last : last + 2])
    return float(low**2), float(high**2)


def _equals(fit: CoefficientFit) -> np.ndarray:
    """(r, 5) the coefficients of the starts that fit as well as the best and swim the same way from rest."""
    if not fit.restarts:
        return np.array([fit.coefficients], float)
    return np.array([restart.coefficients for restart in equals_of(fit.restarts)], float)


def _agreement(fit: CoefficientFit) -> str:
    equals = len(_equals(fit))
    before = ", as it was before Nelder-Mead" if is_polished(fit.restarts) else ""
    if equals == 1:
        return f"No other start came within 1 % of it{before}."
    return f"{equals} starts fit equally well (within 1 % of the best{before}); the table shows how far apart they are."


def _middle(fit: CoefficientFit) -> str:
    if not fit.in_the_middle:
        return ""
    return (
        "The values are the middle of the objective's rough floor, at most 10 % further from the tracks than the "
        "lowest point found: that point leans to where the search came from. "
    )


def _table(fit: CoefficientFit) -> Table:
    equals = _equals(fit)
    low, high = COEFFICIENT_BOUNDS
    rows = []
    for i, name in enumerate(FluidCoefficients._fields):
        mind = [flag.kind.replace("_", " ") for flag in fit.flags if name in flag.message]
        rows.append(
            (
                name.replace("_", " "),
                significant(fit.coefficients[i]),
                significant(PUBLISHED_COEFFICIENTS[i]),
                MISSING if fit.interval is None else " to ".join(significant(end) for end in fit.interval[i]),
                MISSING if len(equals) == 1 else spanned(equals[:, i].min(), equals[:, i].max()),
                ", ".join(mind) or MISSING,
            )
        )
    caption = (
        f"Coefficients of the fluid forces (no unit), bounds {low:g} to {high:g}. “Equals” are the starts "
        "whose objective lies within 1 % of the best, as it was before Nelder-Mead, which no other start gets; "
        "“published” values belong to the authors' own model. The interval is from the curvature at the best and the "
        "noise around it: it knows of no other valley, and takes what the twin cannot follow for noise. In a study on "
        "synthetic tracks with known truth 83 % of these 95 % intervals held it."
    )
    return Table(caption, COLUMNS, tuple(rows))
